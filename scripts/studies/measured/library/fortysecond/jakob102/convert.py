"""Gyro z of a VN-100 in a car that goes in circles beside the rate of its own heading, 40 Hz, from a ROS bag.

The axes point forward, right and down. The bag is of version 2.0; a message holds two headers, a quaternion and nine
numbers of covariance, three rates and nine more, and three accelerations.
"""

import bz2
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np


def records(packed: bytes, at: int = 0) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    while at < len(packed):
        n = struct.unpack_from("<I", packed, at)[0]
        end, at, head = at + 4 + n, at + 4, {}
        while at < end:
            size = struct.unpack_from("<I", packed, at)[0]
            key, value = packed[at + 4 : at + 4 + size].split(b"=", 1)
            head[key] = value
            at += 4 + size
        n = struct.unpack_from("<I", packed, at)[0]
        yield head, packed[at + 4 : at + 4 + n]
        at += 4 + n


def past_header(body: bytes, at: int) -> int:
    return at + 16 + struct.unpack_from("<I", body, at + 12)[0]


topics, rows = {}, []
for head, data in records(Path("raw/lab5/src/data/data_going_in_circles.bag").read_bytes(), 13):
    if head[b"op"] != b"\x05":
        continue
    for inner, body in records(bz2.decompress(data) if head[b"compression"] == b"bz2" else data):
        if inner[b"op"] == b"\x07":
            topics[inner[b"conn"]] = inner[b"topic"]
        if inner[b"op"] == b"\x02" and topics[inner[b"conn"]] == b"/imu":
            seconds, nanoseconds = struct.unpack_from("<II", body, 4)
            values = struct.unpack_from("<37d", body, past_header(body, past_header(body, 0)))
            rows.append([seconds + nanoseconds * 1e-9, *values[:4], values[15]])
held = np.array(rows)
x, y, z, w = held[:, 1:5].T
heading = np.degrees(np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))
table = np.column_stack([held[:, 0] - held[0, 0], heading, held[:, 5]])
np.savetxt("circles.csv", table, delimiter=",", header="time_s,heading_deg,gyro_z", comments="", fmt="%.9g")
