"""Rates of a 3DM-GX3-25 beside the angles that the attitude it sends turns through.

Columns: roll, pitch, yaw [deg], accelerations, rates [rad/s], magnetic field, step of time. The angle about a body
axis is the sum of its part of the rotations between rows.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

data = np.loadtxt("raw/flat_motion2.txt")
attitude = Rotation.from_euler("ZYX", data[:, [2, 1, 0]], degrees=True)
angle = body_angles(attitude)
rows = np.column_stack([data[:, 6:9], angle])
names = "gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("flat.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
