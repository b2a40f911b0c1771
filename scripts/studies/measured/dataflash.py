"""Messages of a DataFlash log of an autopilot, for the converters of the measured library.

A message begins with A3 95 and its kind; one of kind 80 says length, name and letters of the fields of another kind.

Source: ArduPilot, AP_Logger, LogStructure.h.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from insenv.core.recording import Floats

#: Codes of `struct` for letters of the formats that are not the same.
LETTERS = {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B"}
#: Fields of a message of a unit, after its time, and the longest step of time that is no gap [s].
UNIT, GAP = "gx,gy,gz,ax,ay,az", 0.2


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


def two_units(path: Path, written: Path, tick: float, more: Mapping[str, int] | None = None) -> None:
    """Write what two units of a log read, in its longest stretch without a gap, as a table.

    Parameters
    ----------
    path, written : Path
    tick : float
        One count of the log's time [s].
    more : mapping of str to int, optional
        Further fields of the first unit: name of the column to place in the message.
    """
    more = more or {}
    found = messages(path, ("IMU", "IMU2"))
    count = min(len(found["IMU"]), len(found["IMU2"]))
    one, two = found["IMU"][:count], found["IMU2"][:count]
    time = (one[:, 0] - one[0, 0]) * tick
    ends = np.concatenate(([0], np.flatnonzero(np.diff(time) > GAP) + 1, [time.size]))
    longest = int(np.argmax(np.diff(ends)))
    rows = slice(ends[longest], ends[longest + 1])
    columns = (time[rows] - time[rows][0], one[rows, 1:7], *(one[rows, at] for at in more.values()), two[rows, 1:7])
    header = ",".join(["t", UNIT, *more, *(f"{name}2" for name in UNIT.split(","))])
    np.savetxt(written, np.column_stack(columns), fmt="%.9g", delimiter=",", header=header, comments="")
