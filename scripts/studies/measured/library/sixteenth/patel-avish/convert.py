"""Gyro z of a VN-100 in a car that drives circles, beside its own yaw and beside the course of a GPS receiver.

The receiver's stamps are seconds of the day; its course is that between its positions, once a second, while it moves.
"""

import struct
from zipfile import ZipFile

import numpy as np
from ros_bag import messages, texts
from vectornav import RATES, YAW, sentence

with ZipFile("raw/LAB4/Data/donut.zip") as packed:
    packed.extract("donut.bag")
fixes = np.array([(stamp, *struct.unpack_from("<2d", body)) for stamp, body in messages("donut.bag", "/gps")])
numbers = np.array([sentence(body) for _, body in texts("donut.bag", b"VNYMR")])
stamps = np.array([stamp for stamp, _ in messages("donut.bag", "/imu")])
t, gz = stamps - stamps[0], numbers[:, RATES][:, 2]
np.savez("yaw.npz", t=t, gz=gz, yaw=np.unwrap(np.radians(numbers[:, YAW])))
north, east = np.diff(fixes[:, 1]), np.diff(fixes[:, 2]) * np.cos(np.radians(fixes[0, 1]))
at = 0.5 * (fixes[1:, 0] + fixes[:-1, 0]) + 86400 * (stamps[0] // 86400) - stamps[0]
drives = np.flatnonzero(np.hypot(north, east) * 111_111 > 1.0)
course = np.interp(t, at, np.unwrap(np.arctan2(east, north)))
inside = (t > at[drives[0]]) & (t < at[drives[-1]])
np.savez("course.npz", t=t[inside], gz=gz[inside], course=course[inside])
