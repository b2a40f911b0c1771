"""A telephone's gyros beside the angles that its own orientation turns through, the last 49 s (it lies still before).

The angle about a body axis is the sum of its part of the rotations between rows.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

sent = np.loadtxt("raw/Orientation.csv", delimiter=",", skiprows=1, usecols=(1, 4, 3, 2, 5))
gyro = np.loadtxt("raw/Gyroscope.csv", delimiter=",", skiprows=1, usecols=(1, 4, 3, 2))
turning = gyro[:, 0] >= gyro[-1, 0] - 49.0
attitude = Rotation.from_quat(sent[turning, 1:])
angle = body_angles(attitude)
names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
rows = np.column_stack([gyro[turning], angle])
np.savetxt("phone.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
