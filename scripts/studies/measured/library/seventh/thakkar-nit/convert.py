"""Messages of `/imu` (imu_driver/Vectornav) of a ROS bag as a table: insenv reads no bags.

Time stamps of the headers, rates [rad/s], accelerations [m/s^2].
"""

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

BAG = Path("raw/LAB3/src/Data/nitin.bag")
OUT = "nitin.csv"


def fields(head: bytes) -> dict[bytes, bytes]:
    """Fields `name=value` of a record's header, each with its length before it."""
    out, at = {}, 0
    while at < len(head):
        (size,) = struct.unpack_from("<I", head, at)
        name, _, value = head[at + 4 : at + 4 + size].partition(b"=")
        out[name] = value
        at += 4 + size
    return out


def records(data: bytes) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    """Header and data of each record; those of chunks (op 5) in their place."""
    at = 0
    while at < len(data):
        (size,) = struct.unpack_from("<I", data, at)
        head = fields(data[at + 4 : at + 4 + size])
        at += 4 + size
        (size,) = struct.unpack_from("<I", data, at)
        body = data[at + 4 : at + 4 + size]
        at += 4 + size
        if head[b"op"] == b"\x05":
            yield from records(body)
        else:
            yield head, body


def row(body: bytes) -> list[float]:
    """Stamp, rates and accelerations of a message: header, quaternion of four, then vectors of three."""
    _, seconds, nanoseconds, size = struct.unpack_from("<IIII", body)
    numbers = struct.unpack_from("<10d", body, 16 + size)
    return [seconds + 1e-9 * nanoseconds, *numbers[4:10]]


found = list(records(BAG.read_bytes()[13:]))
topics = {head[b"conn"]: head[b"topic"] for head, _ in found if head[b"op"] == b"\x07"}
rows = np.array([row(body) for head, body in found if head[b"op"] == b"\x02" and topics[head[b"conn"]] == b"/imu"])
rows[:, 0] -= rows[0, 0]
names = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt(OUT, rows, delimiter=",", header=names, comments="", fmt="%.9g")
