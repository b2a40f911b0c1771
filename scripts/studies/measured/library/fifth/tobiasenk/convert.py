"""Gyros and accelerometers of a telephone as one table: each row of the accelerometers with the gyros' nearest."""

import numpy as np

HERE = "raw/phyphox_experiments/Test 2022-10-20_14-25-10"
accel, gyro = (np.loadtxt(f"{HERE}/{n}.csv", delimiter=",", skiprows=1) for n in ("Accelerometer", "Gyroscope"))
middle = 0.5 * (gyro[1:, 0] + gyro[:-1, 0])
rows = np.column_stack([accel, gyro[np.searchsorted(middle, accel[:, 0]), 1:]])
names = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
np.savetxt("phone.csv", rows, delimiter=",", header=names, comments="", fmt="%.10g")
