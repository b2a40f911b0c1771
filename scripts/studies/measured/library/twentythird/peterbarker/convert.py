"""Two units of an autopilot in two flights: gyros and accelerometers, each flight's longest stretch without a gap."""

from pathlib import Path

import numpy as np
from dataflash import messages

NAMES = "gx,gy,gz,ax,ay,az"
HEADER = f"t,{NAMES}," + ",".join(f"{name}2" for name in NAMES.split(","))
for number, name in {"1": "first", "3": "third"}.items():
    found = messages(Path(f"raw/{number}.BIN"), ("IMU", "IMU2"))
    one, two = found["IMU"], found["IMU2"]
    time = (one[:, 0] - one[0, 0]) * 1e-3
    ends = np.concatenate(([0], np.flatnonzero(np.diff(time) > 0.2) + 1, [time.size]))
    longest = int(np.argmax(np.diff(ends)))
    rows = slice(ends[longest], ends[longest + 1])
    table = np.column_stack((time[rows] - time[rows][0], one[rows, 1:7], two[rows, 1:7]))
    np.savetxt(f"{name}.csv", table, fmt="%.9g", delimiter=",", header=HEADER, comments="")
