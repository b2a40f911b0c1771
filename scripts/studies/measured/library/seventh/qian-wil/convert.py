"""Messages of `/imu` of a ROS 2 bag (SQLite): rates beside the angles of the unit's attitude, by the recorder's stamps.

A message closes with the sentence of the unit. The angle about a body axis is the sum of its part of the rotations
between rows.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles
from vectornav import ATTITUDE, RATES, messages, sentence

found = list(messages("raw/LAB4/data/data_going_in_circles2/data_going_in_circles2.db3", "/imu"))
told = np.array([sentence(message) for _, message in found])
angle = body_angles(Rotation.from_euler("ZYX", told[:, ATTITUDE], degrees=True))
time = 1e-9 * (np.array([stamp for stamp, _ in found]) - found[0][0])
names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
rows = np.column_stack([time, told[:, RATES], angle])
np.savetxt("circles.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
