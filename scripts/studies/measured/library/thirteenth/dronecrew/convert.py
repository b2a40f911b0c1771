"""Both units' rows of a flight log, with the time that stands before them."""

import struct
from pathlib import Path

import numpy as np

LETTERS = {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B"}


def messages(path, wanted):
    """Rows of numbers of the wanted messages of a DataFlash log."""
    data, formats, out, at = path.read_bytes(), {}, {name: [] for name in wanted}, 0
    while at + 89 <= len(data):
        kind = data[at + 2]
        if data[at : at + 3] == b"\xa3\x95\x80":
            number, length, name, letters, columns = struct.unpack("<BB4s16s64s", data[at + 3 : at + 89])
            text = letters.rstrip(b"\0").decode()
            formats[number] = (length, name.rstrip(b"\0").decode(), text)
            at += 89
        elif data[at : at + 2] == b"\xa3\x95" and kind in formats:
            length, name, text = formats[kind]
            if name in wanted:
                codes = "<" + "".join(LETTERS.get(letter, letter) for letter in text)
                out[name].append(struct.unpack(codes, data[at + 3 : at + length]))
            at += length
        else:
            at += 1
    return {name: np.array(rows) for name, rows in out.items()}


found = messages(Path("raw/test/log/01_07_59.px4log"), ("TIME", "IMU", "IMU1"))
time = (found["TIME"][:, 0] - found["TIME"][0, 0]) * 1e-6
table = np.column_stack((time, found["IMU"][:, :6], found["IMU1"][:, :6]))
names = "t,ax,ay,az,gx,gy,gz,ax2,ay2,az2,gx2,gy2,gz2"
np.savetxt("flight.csv", table, fmt="%.9g", delimiter=",", header=names, comments="")
