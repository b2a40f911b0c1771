"""The sentence $VNYMR of a VN-100, for the converters of the measured library.

It holds yaw, pitch, roll [deg], three of the magnetic field, three accelerations [m/s^2] and three rates [rad/s]; a
checksum follows the star.

Source: VectorNav, VN-100 User Manual UM001, asynchronous outputs.
"""

from __future__ import annotations

import csv
import re
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

#: Where the numbers of a sentence stand.
YAW, ATTITUDE, ACCELERATIONS, RATES = 0, slice(0, 3), slice(6, 9), slice(9, 12)
NAMES = "t,yaw,pitch,roll,mx,my,mz,ax,ay,az,gx,gy,gz"
_SENTENCE = re.compile(rb"\$VNYMR,([-+.,0-9]*)")
_NUMBERS = 12
_OF_TOPIC = "SELECT timestamp, data FROM messages JOIN topics ON topic_id = topics.id WHERE name = ? ORDER BY timestamp"


def sentences(data: bytes) -> Iterator[tuple[int, list[float]]]:
    """Place and numbers of each sentence in some bytes."""
    for found in _SENTENCE.finditer(data):
        yield found.start(), [float(word) for word in found[1].split(b",")]


def sentence(data: bytes) -> list[float]:
    """Numbers of the first sentence in some bytes."""
    _, numbers = next(sentences(data))
    return numbers


def of_a_table(path: Path) -> list[list[float]]:
    """Stamp [s] and numbers of the whole sentences in a table of messages, their stamps in two columns."""
    rows = []
    with path.open(encoding="utf-8") as lines:
        for line in csv.reader(lines):
            text = next((cell for cell in line if "$VNYMR" in cell), "")
            numbers = next((numbers for _, numbers in sentences(text.encode())), [])
            if len(numbers) == _NUMBERS:
                rows.append([float(line[2]) + 1e-9 * float(line[3]), *numbers])
    return rows


def messages(bag: str, topic: str) -> Iterator[tuple[int, bytes]]:
    """The recorder's stamp [ns] and the bytes of a topic's messages in a bag of ROS 2 (SQLite), by their stamps."""
    with sqlite3.connect(bag) as database:
        yield from database.execute(_OF_TOPIC, (topic,))


def save(path: str, names: str, rows: Sequence[Sequence[float]], digits: int = 15) -> None:
    """A table whose time is counted from its first row."""
    table = np.array(rows)
    table[:, 0] -= table[0, 0]
    np.savetxt(path, table, delimiter=",", header=names, comments="", fmt=f"%.{digits}g")
