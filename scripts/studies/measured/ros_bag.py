"""The records of a ROS bag of version 2.0, for the converters of the measured library.

Source: the ROS wiki, Bags/Format/2.0.
"""

from __future__ import annotations

import bz2
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from insenv.core.recording import Floats

#: Kinds of records that the converters look at, in the field "op": of chunks, connections and messages.
CHUNK, CONNECTION, MESSAGE = b"\x05", b"\x07", b"\x02"


def records(bag: Path) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    """Fields of the header, and the data, of each record; chunks are opened."""
    return _records(bag.read_bytes().partition(b"\n")[2])


def messages(file: str, topic: bytes) -> Iterator[tuple[float, bytes]]:
    """Stamps [s] of a topic's messages that begin with a header, and what follows it."""
    topics = {}
    for fields, body in records(Path(file)):
        if fields[b"op"] == CONNECTION:
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == MESSAGE and topics[fields[b"conn"]] == topic:
            _, seconds, nanoseconds, n = struct.unpack_from("<IIII", body)
            yield seconds + nanoseconds * 1e-9, body[16 + n :]


def texts(file: str, word: bytes) -> Iterator[tuple[float, bytes]]:
    """Stamps [s] at which the messages that hold a word were recorded, and those messages."""
    for fields, body in records(Path(file)):
        if fields[b"op"] == MESSAGE and word in body:
            seconds, nanoseconds = struct.unpack("<II", fields[b"time"])
            yield seconds + nanoseconds * 1e-9, body


def imu(file: str, topic: bytes) -> tuple[Floats, Floats, Floats]:
    """Times [s], quaternions (x, y, z, w) and rates [rad/s] of sensor_msgs/Imu: shapes (n,), (n, 4), (n, 3)."""
    rows = np.array([(stamp, *struct.unpack_from("<16d", body)) for stamp, body in messages(file, topic)])
    return rows[:, 0], rows[:, 1:5], rows[:, 14:17]


def _records(data: bytes) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    place = 0
    while place < len(data):
        head, place = _counted(data, place)
        body, place = _counted(data, place)
        fields = _fields(head)
        if fields[b"op"] == CHUNK:
            yield from _records(bz2.decompress(body) if fields[b"compression"] == b"bz2" else body)
        else:
            yield fields, body


def _fields(head: bytes) -> dict[bytes, bytes]:
    found, place = {}, 0
    while place < len(head):
        field, place = _counted(head, place)
        key, _, found[key] = field.partition(b"=")
    return found


def _counted(data: bytes, place: int) -> tuple[bytes, int]:
    """What stands behind its length at a place, and the place after it."""
    (size,) = struct.unpack_from("<I", data, place)
    return data[place + 4 : place + 4 + size], place + 4 + size
