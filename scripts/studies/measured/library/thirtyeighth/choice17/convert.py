"""An MPU-9250 that lies on a table, as a program smooths it, 15 min: the rest before it is pushed, and all of it."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/imu/data.csv"), delimiter=",", skiprows=1, usecols=range(7))
rows[:, 0] -= rows[0, 0]
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("lies.csv", rows[2100:4700], delimiter=",", header=head, comments="", fmt="%.9g")
np.savetxt("pushed.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
