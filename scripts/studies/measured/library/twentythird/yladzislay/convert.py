"""Two units of an autopilot in flight, the first one's temperature beside them; longest stretches without a gap."""

from pathlib import Path

import numpy as np
from dataflash import messages

NAMES = "gx,gy,gz,ax,ay,az"
HEADER = f"t,{NAMES},T," + ",".join(f"{name}2" for name in NAMES.split(","))
for file in sorted(Path("raw").rglob("*.bin")):
    found = messages(file, ("IMU", "IMU2"))
    count = min(len(found["IMU"]), len(found["IMU2"]))
    one, two = found["IMU"][:count], found["IMU2"][:count]
    time = (one[:, 0] - one[0, 0]) * 1e-6
    ends = np.concatenate(([0], np.flatnonzero(np.diff(time) > 0.2) + 1, [time.size]))
    longest = int(np.argmax(np.diff(ends)))
    rows = slice(ends[longest], ends[longest + 1])
    table = np.column_stack((time[rows] - time[rows][0], one[rows, 1:7], one[rows, 9], two[rows, 1:7]))
    np.savetxt(f"{file.stem}.csv", table, fmt="%.9g", delimiter=",", header=HEADER, comments="")
