"""Gyro z of the VN-100 in a car beside its own yaw.

The messages of the ROS bag hold the line of the unit (VNYMR) with yaw, pitch and roll, the field, accelerations and
rates. Times are those at which they were recorded.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import MESSAGE, records


def rows(file):
    for fields, body in records(Path(file)):
        if fields[b"op"] == MESSAGE and b"VNYMR" in body:
            seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
            words = body[body.find(b"VNYMR") :].split(b"*")[0].split(b",")
            yield [seconds + nanoseconds * 1e-9, *map(float, words[1:])]


log = np.array(list(rows("raw/Lab 4/src/analysis/circle_data.bag")))
np.savez("circles.npz", t=log[:, 0] - log[0, 0], gz=log[:, 12], yaw=log[:, 1])
