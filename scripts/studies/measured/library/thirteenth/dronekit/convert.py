"""Both units' rows of a flight log, on the ground and in the air; stamps are milliseconds."""

from pathlib import Path

import numpy as np
from dataflash import messages

found = messages(Path("raw/log171.bin"), ("IMU", "IMU2"))
first, second = found["IMU"], found["IMU2"]
time = (first[:, 0] - first[0, 0]) * 1e-3
table = np.column_stack((time, first[:, 1:7], first[:, 9], second[:, 1:7], second[:, 9]))
names = "t,gx,gy,gz,ax,ay,az,temp,gx2,gy2,gz2,ax2,ay2,az2,temp2"
for part, start, end in (("ground", 31.0, 61.0), ("flight", 75.0, 212.0)):
    kept = table[(time > start) & (time < end)]
    np.savetxt(f"{part}.csv", kept, fmt="%.9g", delimiter=",", header=names, comments="")
