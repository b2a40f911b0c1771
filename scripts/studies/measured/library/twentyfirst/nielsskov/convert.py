"""A ship model's unit at rest for hours: a matrix of messages with the host's times, as they came."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

rows = loadmat(Path("raw/figures/Original/Matlab/IMUVariances") / "imu_data_06042017.mat")["data"]
table = np.column_stack([(rows[:, 0] - rows[0, 0]) / 1e9, rows[:, 2:8]])
header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt("hours.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
