"""Gyro z of the VN-100 in a car beside the yaw of the quaternion in the same message.

A message of the ROS bag is a header, then sensor_msgs/Imu: header, quaternion with covariance, three rates. Times are
those of the outer header.
"""

import bz2
import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation


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


def messages(file):
    topics = {}
    for fields, body in records(Path(file).read_bytes().partition(b"\n")[2]):
        if fields[b"op"] == b"\x07":
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == b"\x02" and topics[fields[b"conn"]] == b"/imu":
            seconds, nanoseconds, name = struct.unpack_from("<3I", body, 4)
            (inner,) = struct.unpack_from("<I", body, 28 + name)
            place = 32 + name + inner
            quaternion, rates = struct.unpack_from("<4d", body, place), struct.unpack_from("<3d", body, place + 13 * 8)
            yield [seconds + nanoseconds * 1e-9, *quaternion, rates[2]]


log = np.array(list(messages("raw/lab5/src/data/data_going_in_circles.bag")))
yaw = np.unwrap(Rotation.from_quat(log[:, 1:5]).as_euler("ZYX")[:, 0])
np.savez("circles.npz", t=log[:, 0] - log[0, 0], gz=log[:, 5], yaw=yaw)
