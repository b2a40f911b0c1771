"""The gyro of a robot's upright axis beside the heading of its wheel odometry, both out of a bag."""

import struct
from pathlib import Path

import numpy as np
from ros_bag import CONNECTION, MESSAGE, records


def messages(file, topic):
    """Stamps of a topic's messages, and what follows their headers."""
    topics = {}
    for fields, body in records(Path(file)):
        if fields[b"op"] == CONNECTION:
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == MESSAGE and topics[fields[b"conn"]] == topic:
            _, seconds, nanoseconds, n = struct.unpack_from("<IIII", body)
            yield seconds + nanoseconds * 1e-9, body[16 + n :]


def imu(file, topic):
    """Times, quaternions (x, y, z, w) and rates [rad/s] of an inertial unit's messages."""
    rows = np.array([(stamp, *struct.unpack_from("<16d", body)) for stamp, body in messages(file, topic)])
    return rows[:, 0], rows[:, 1:5], rows[:, 14:17]


def heading(file, topic):
    """Times and headings [rad] of odometry: the frame's name stands before position and quaternion."""
    for stamp, body in messages(file, topic):
        (n,) = struct.unpack_from("<I", body)
        *_, z, w = struct.unpack_from("<7d", body, 4 + n)
        yield stamp, 2.0 * np.arctan2(z, w)


BAG = "raw/test/test1.bag"
time, _, rate = imu(BAG, b"/imu/data")
wheels = np.array(list(heading(BAG, b"/husky_velocity_controller/odom")))
angle = np.interp(time, wheels[:, 0], np.unwrap(wheels[:, 1]))
both = (time >= wheels[0, 0]) & (time <= wheels[-1, 0])
np.savetxt(
    "husky.csv",
    np.column_stack((time - time[0], rate[:, 1], angle))[both],
    delimiter=",",
    header="time,gyro,heading",
    comments="",
    fmt="%.12g",
)
