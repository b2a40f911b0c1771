"""Both units' rows of a flight log, with the time that stands before them."""

from pathlib import Path

import numpy as np
from dataflash import messages

found = messages(Path("raw/test/log/01_07_59.px4log"), ("TIME", "IMU", "IMU1"))
time = (found["TIME"][:, 0] - found["TIME"][0, 0]) * 1e-6
table = np.column_stack((time, found["IMU"][:, :6], found["IMU1"][:, :6]))
names = "t,ax,ay,az,gx,gy,gz,ax2,ay2,az2,gx2,gy2,gz2"
np.savetxt("flight.csv", table, fmt="%.9g", delimiter=",", header=names, comments="")
