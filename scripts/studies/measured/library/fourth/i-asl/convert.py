"""A drone's gyros beside what the motion capture's attitude turned about their axes.

The clocks are set to each other to a tenth of a second; the optical body's axes are those of the gyros turned by right
angles. Rows in which the optical system saw nothing are zeros.
"""

import bz2
import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

# of each flight: the bag's first row on the optical clock [s]; of the gyro that is wanted: its axis, the optical one
FLIGHTS = {1: (1.3, "z", "-z"), 2: (-0.7, "x", "x"), 3: (0.9, "z", "-z")}


def records(data):
    """The records of a ROS bag: fields of the header, and the data; chunks are opened."""
    place = 0
    while place < len(data):
        (size,) = struct.unpack_from("<I", data, place)
        head, place = data[place + 4 : place + 4 + size], place + 4 + size
        (size,) = struct.unpack_from("<I", data, place)
        body, place = data[place + 4 : place + 4 + size], place + 4 + size
        fields = {}
        while head:
            (n,) = struct.unpack_from("<I", head)
            key, _, value = head[4 : 4 + n].partition(b"=")
            fields[key], head = value, head[4 + n :]
        if fields[b"op"] == b"\x05":
            yield from records(bz2.decompress(body) if fields[b"compression"] == b"bz2" else body)
        else:
            yield fields, body


def messages(file, topic):
    """Stamps of a topic's messages, and what follows their headers."""
    topics = {}
    for fields, body in records(Path(file).read_bytes().partition(b"\n")[2]):
        if fields[b"op"] == b"\x07":
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == b"\x02" and topics[fields[b"conn"]] == topic:
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
