"""An MPU-9250 turned about by hand for the calibration of its magnetometer; its columns have numbers for names."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/imu_readings.csv"), delimiter=",", skiprows=1)
head = "acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("turned.csv", rows[:, 4:10], delimiter=",", header=head, comments="", fmt="%.9g")
