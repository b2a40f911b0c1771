"""A phone that is turned about: gyros and accelerometers as it logs them, the z column first."""

from pathlib import Path

import numpy as np

gyro, force = (
    np.genfromtxt(Path("raw") / f, delimiter=",", skip_header=1) for f in ("Gyroscope.csv", "Accelerometer.csv")
)
table = np.column_stack([gyro[:, 1] - gyro[0, 1], gyro[:, [4, 3, 2]], force[:, [4, 3, 2]]])
header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt("phone.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
