"""Rates of an x-IMU [deg/s] beside the angles that its rotation matrix turns through, a row each 1/256 s.

The angle about a body axis is the sum of its part of the rotations between rows.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

HERE = "raw/LoggedData/LoggedData"
gyro = np.loadtxt(f"{HERE}_CalInertialAndMag.csv", delimiter=",", skiprows=1)[:, 1:4]
matrix = np.loadtxt(f"{HERE}_RotationMatrix.csv", delimiter=",", skiprows=1)[:, 1:]
attitude = Rotation.from_matrix(matrix.reshape(-1, 3, 3))
angle = body_angles(attitude)
names = "gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("hand.csv", np.column_stack([gyro, angle]), delimiter=",", header=names, comments="", fmt="%.15g")
