"""Gyro z of the VN-100 in a car beside the yaw of the quaternion in the same message.

A message of the ROS bag is a header, then sensor_msgs/Imu: header, quaternion with covariance, three rates. Times are
those of the outer header.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import CONNECTION, MESSAGE, records
from scipy.spatial.transform import Rotation


def messages(file):
    topics = {}
    for fields, body in records(Path(file)):
        if fields[b"op"] == CONNECTION:
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == MESSAGE and topics[fields[b"conn"]] == b"/imu":
            seconds, nanoseconds, name = struct.unpack_from("<3I", body, 4)
            (inner,) = struct.unpack_from("<I", body, 28 + name)
            place = 32 + name + inner
            quaternion, rates = struct.unpack_from("<4d", body, place), struct.unpack_from("<3d", body, place + 13 * 8)
            yield [seconds + nanoseconds * 1e-9, *quaternion, rates[2]]


log = np.array(list(messages("raw/lab5/src/data/data_going_in_circles.bag")))
yaw = np.unwrap(Rotation.from_quat(log[:, 1:5]).as_euler("ZYX")[:, 0])
np.savez("circles.npz", t=log[:, 0] - log[0, 0], gz=log[:, 5], yaw=yaw)
