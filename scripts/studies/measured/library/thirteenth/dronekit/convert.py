"""Both units' rows of a flight log, on the ground and in the air; stamps are milliseconds."""

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


found = messages(Path("raw/log171.bin"), ("IMU", "IMU2"))
first, second = found["IMU"], found["IMU2"]
time = (first[:, 0] - first[0, 0]) * 1e-3
table = np.column_stack((time, first[:, 1:7], first[:, 9], second[:, 1:7], second[:, 9]))
names = "t,gx,gy,gz,ax,ay,az,temp,gx2,gy2,gz2,ax2,ay2,az2,temp2"
for part, start, end in (("ground", 31.0, 61.0), ("flight", 75.0, 212.0)):
    kept = table[(time > start) & (time < end)]
    np.savetxt(f"{part}.csv", kept, fmt="%.9g", delimiter=",", header=names, comments="")
