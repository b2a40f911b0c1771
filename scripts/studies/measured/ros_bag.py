"""The records of a ROS bag of version 2.0, for the converters of the measured library.

Source: the ROS wiki, Bags/Format/2.0.
"""

from __future__ import annotations

import bz2
import struct
from collections.abc import Iterator
from pathlib import Path

#: Kinds of records that the converters look at, in the field "op": of chunks, connections and messages.
CHUNK, CONNECTION, MESSAGE = b"\x05", b"\x07", b"\x02"


def records(bag: Path) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    """Fields of the header, and the data, of each record; chunks are opened."""
    return _records(bag.read_bytes().partition(b"\n")[2])


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
