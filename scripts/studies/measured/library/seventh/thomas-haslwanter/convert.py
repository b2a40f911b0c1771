"""Rates of an x-IMU [deg/s] beside the angles that its rotation matrix turns through, which comes in each second row.

The numbers of the packets tell after which row a matrix came; a row is 1/256 s. The angle about a body axis is the sum
of its part of the rotations between matrices.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

HERE = "raw/tests/data/data_xio/00033"
gyro = np.loadtxt(f"{HERE}_CalInertialAndMag.csv", delimiter=",", skiprows=1)[:, :4]
matrix = np.loadtxt(f"{HERE}_RotationMatrix.csv", delimiter=",", skiprows=1)
attitude = Rotation.from_matrix(matrix[:, 1:].reshape(-1, 3, 3))
angle = body_angles(attitude)
after = np.searchsorted(gyro[:, 0], matrix[:, 0]) - 1
angles = [np.interp(np.arange(after[-1] + 1), after, angle[:, k]) for k in range(3)]
rows = np.column_stack([gyro[: after[-1] + 1, 1:], *angles])
names = "gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("xio33.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
