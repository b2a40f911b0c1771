"""A drone's gyros beside what the motion capture's attitude turned about their axes.

The clocks are set to each other to a tenth of a second; the optical body's axes are those of the gyros turned by right
angles. Rows in which the optical system saw nothing are zeros.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import CONNECTION, MESSAGE, records
from scipy.spatial.transform import Rotation

# of each flight: the bag's first row on the optical clock [s]; of the gyro that is wanted: its axis, the optical one
FLIGHTS = {1: (1.3, "z", "-z"), 2: (-0.7, "x", "x"), 3: (0.9, "z", "-z")}


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


def turned(attitude):
    return np.concatenate((np.zeros((1, 3)), np.cumsum((attitude[:-1].inv() * attitude[1:]).as_rotvec(), axis=0)))


for flight, (begin, axis, optical) in FLIGHTS.items():
    time, _, rate = imu(f"raw/rosbag/0612_hw{flight}.bag", b"/imu/data")
    time += begin - time[0]
    truth = np.loadtxt(f"raw/scenario{flight}/gt.csv", skiprows=1)
    truth = truth[np.abs(truth[:, 4:]).sum(axis=1) > 0.0]
    attitude = Rotation.from_matrix(truth[:, 4:].reshape(-1, 3, 3).transpose(0, 2, 1))
    angle = turned(attitude)[:, "xyz".index(optical[-1])] * (-1.0 if optical[0] == "-" else 1.0)
    both = (time >= truth[0, 0]) & (time <= truth[-1, 0])
    np.savetxt(
        f"drone{flight}.csv",
        np.column_stack((time, rate[:, "xyz".index(axis)], np.interp(time, truth[:, 0], angle)))[both],
        delimiter=",",
        header=f"time,gyro_{axis},angle_{axis}",
        comments="",
        fmt="%.12g",
    )
