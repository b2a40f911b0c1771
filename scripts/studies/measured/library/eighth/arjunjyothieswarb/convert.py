"""Gyro z of the VN-100 in a car beside its own yaw.

The messages of the ROS bag hold the line of the unit (VNYMR) with yaw, pitch and roll, the field, accelerations and
rates. Times are those at which they were recorded.
"""

import bz2
import struct
from pathlib import Path

import numpy as np


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


def rows(file):
    for fields, body in records(Path(file).read_bytes().partition(b"\n")[2]):
        if fields[b"op"] == b"\x02" and b"VNYMR" in body:
            seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
            words = body[body.find(b"VNYMR") :].split(b"*")[0].split(b",")
            yield [seconds + nanoseconds * 1e-9, *map(float, words[1:])]


log = np.array(list(rows("raw/Lab 4/src/analysis/circle_data.bag")))
np.savez("circles.npz", t=log[:, 0] - log[0, 0], gz=log[:, 12], yaw=log[:, 1])
