"""Packets of the radio arrive twice and out of order: each time once, in order, in seconds from the first."""

import numpy as np

rows = np.genfromtxt("raw/data/still.csv", delimiter=",", skip_header=1)
rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
rows[:, 0] = (rows[:, 0] - rows[0, 0]) / 1e3
head = "time_s,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
np.savetxt("still.csv", rows, fmt=["%.3f"] + ["%.8g"] * 6, delimiter=",", header=head, comments="")
