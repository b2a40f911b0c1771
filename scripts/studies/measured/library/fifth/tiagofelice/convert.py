"""Gyros and accelerometers of a telephone as one table: row by row, 1 ms apart, at the accelerometers' times."""

import numpy as np

accel, gyro = (
    np.loadtxt(f"raw/data/raw/low_noise/{name}.csv", delimiter=",", skiprows=1)
    for name in ("Accelerometer", "Gyroscope")
)
names = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
rows = np.column_stack([accel, gyro[:, 1:]])
np.savetxt("phone.csv", rows, delimiter=",", header=names, comments="", fmt="%.10g")
