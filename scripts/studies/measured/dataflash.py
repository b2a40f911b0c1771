"""Messages of a DataFlash log of an autopilot, for the converters of the measured library.

A message begins with A3 95 and its kind; one of kind 80 says length, name and letters of the fields of another kind.

Source: ArduPilot, AP_Logger, LogStructure.h.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from insenv.core.recording import Floats

#: Codes of `struct` for letters of the formats that are not the same.
LETTERS = {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B"}


def messages(path: Path, wanted: tuple[str, ...]) -> dict[str, Floats]:
    """Rows of numbers of each kind of message that is wanted, shape (n, fields)."""
    data, at = path.read_bytes(), 0
    formats: dict[int, tuple[int, str, str]] = {}
    out: dict[str, list[tuple[float, ...]]] = {name: [] for name in wanted}
    while at + 89 <= len(data):
        kind = data[at + 2]
        if data[at : at + 3] == b"\xa3\x95\x80":
            number, length, name, letters, _ = struct.unpack("<BB4s16s64s", data[at + 3 : at + 89])
            text = letters.rstrip(b"\0").decode()
            formats[number] = (length, name.rstrip(b"\0").decode(), text)
            at += 89
        elif data[at : at + 2] == b"\xa3\x95" and kind in formats:
            length, title, text = formats[kind]
            if title in wanted:
                codes = "<" + "".join(LETTERS.get(letter, letter) for letter in text)
                out[title].append(struct.unpack(codes, data[at + 3 : at + length]))
            at += length
        else:
            at += 1
    return {name: np.array(rows) for name, rows in out.items()}
