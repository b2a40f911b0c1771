"""The last 24 s of a rocket's nose cone: it has landed and lies still."""

import numpy as np

rows = np.loadtxt("raw/cone decode/imu_cone_crop.out_imu", delimiter=",", skiprows=1)
names = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt("landed.csv", rows[rows[:, 0] > 676.0], delimiter=",", header=names, comments="", fmt="%.9g")
