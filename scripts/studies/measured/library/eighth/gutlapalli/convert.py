"""Gyro z of a VN-100 moved in the hand beside what its own attitude turned about its own z.

The messages of the ROS bag hold the line of the unit (VNYMR) with yaw, pitch and roll, the field, accelerations and
rates. Times are those at which they were recorded.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import MESSAGE, records
from scipy.spatial.transform import Rotation


def rows(file):
    for fields, body in records(Path(file)):
        if fields[b"op"] == MESSAGE and b"VNYMR" in body:
            seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
            words = body[body.find(b"VNYMR") :].split(b"*")[0].split(b",")
            yield [seconds + nanoseconds * 1e-9, *map(float, words[1:])]


log = np.array(list(rows("raw/LAB3/src/Data/motion_data.bag")))
attitude = Rotation.from_euler("ZYX", log[:, 1:4], degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 2]
angle = np.concatenate(([0.0], np.cumsum(turned)))
np.savez("hand.npz", t=log[:, 0] - log[0, 0], gz=log[:, 12], angle=angle)
