"""Gyro z of the VN-100 in a car beside the yaw of the quaternion in the same message.

A message of the ROS bag is a header, then sensor_msgs/Imu: header, quaternion with covariance, three rates. Times are
those of the outer header.
"""

import struct

import numpy as np
from ros_bag import messages
from scipy.spatial.transform import Rotation


def row(stamp, body):
    (inner,) = struct.unpack_from("<I", body, 12)
    place = 16 + inner
    return stamp, *struct.unpack_from("<4d", body, place), struct.unpack_from("<3d", body, place + 13 * 8)[2]


log = np.array([row(*message) for message in messages("raw/lab5/src/data/data_going_in_circles.bag", "/imu")])
yaw = np.unwrap(Rotation.from_quat(log[:, 1:5]).as_euler("ZYX")[:, 0])
np.savez("circles.npz", t=log[:, 0] - log[0, 0], gz=log[:, 5], yaw=yaw)
