"""Gyro z of the VN-100 in a car beside its own yaw, out of the unit's sentence in the messages of a ROS 2 bag (SQLite).

Times are those of the messages' headers.
"""

import struct

import numpy as np
from vectornav import RATES, YAW, messages, sentence

bodies = [body for _, body in messages("raw/LAB4/data/data_circle2/data_circle2_0.db3", "/imu")]
stamps = [struct.unpack_from("<iI", body, 4) for body in bodies]
told = np.array([sentence(body) for body in bodies])
time = np.array([seconds - stamps[0][0] + nanoseconds * 1e-9 for seconds, nanoseconds in stamps])
np.savez("circles.npz", t=time - time[0], gz=told[:, RATES][:, 2], yaw=told[:, YAW])
