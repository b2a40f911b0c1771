"""Messages of ROS bags of version 2.0 as their bytes, for the converters of the measured library."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from insenv.core.recording import Floats
from insenv.data.readers.bags import messages_of_bag


def messages(file: str, topic: str) -> Iterator[tuple[float, bytes]]:
    """Stamps [s] of a topic's messages that begin with a header, and what follows it."""
    for message in messages_of_bag(Path(file)):
        if message.topic == topic:
            yield behind_header(message.body)


def behind_header(body: bytes) -> tuple[float, bytes]:
    """Stamp [s] of a message that begins with a header, and what follows it."""
    _, seconds, nanoseconds, n = struct.unpack_from("<IIII", body)
    return seconds + nanoseconds * 1e-9, body[16 + n :]


def texts(file: str, word: bytes) -> Iterator[tuple[float, bytes]]:
    """Times of recording [s] of the messages that hold a word, and those messages."""
    for message in messages_of_bag(Path(file)):
        if word in message.body:
            yield message.recorded, message.body


def imu(file: str, topic: str) -> tuple[Floats, Floats, Floats]:
    """Times [s], quaternions (x, y, z, w) and rates [rad/s] of sensor_msgs/Imu: shapes (n,), (n, 4), (n, 3)."""
    rows = np.array([(stamp, *struct.unpack_from("<16d", body)) for stamp, body in messages(file, topic)])
    return rows[:, 0], rows[:, 1:5], rows[:, 14:17]
