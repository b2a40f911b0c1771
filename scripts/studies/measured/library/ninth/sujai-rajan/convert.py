"""Gyro z of the VN-100 in the car beside its heading, and beside what its attitude turned about its own z.

The bag's messages hold the unit's line ($VNYMR) with yaw, pitch and roll. Times are those at which they were recorded.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import MESSAGE, records
from scipy.spatial.transform import Rotation


def rows(file):
    for fields, body in records(Path(file)):
        if fields[b"op"] == MESSAGE and b"$VNYMR" in body:
            seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
            words = body[body.find(b"$VNYMR") :].split(b"*")[0].split(b",")
            yield [seconds + nanoseconds * 1e-9, *map(float, words[1:])]


log = np.array(list(rows("raw/LAB 4/data/data_going_in_circles.bag")))
attitude = Rotation.from_euler("ZYX", log[:, 1:4], degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 2]
np.savetxt(
    "circles.csv",
    np.column_stack((log[:, 0] - log[0, 0], log[:, 12], log[:, 1], np.concatenate(([0.0], np.cumsum(turned))))),
    fmt="%.7f",
    delimiter=",",
    header="t,gz,yaw,angle_z",
    comments="",
)
