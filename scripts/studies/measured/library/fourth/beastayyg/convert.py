"""Gyro y of an autopilot's two units, and what its attitude turned about y, out of its binary log."""

import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

LOG = "raw/data/clean_imports/background_expert_01/benchmark_ready/dataset/log_0036_mechanical_failure.bin"
KINDS = ("IMU", "IMU2", "ATT")
# where a log's code is not that of struct
CODES = {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B"}
HUNDREDTHS = "cCeE"


def rows(data):
    """The messages of the kinds that are wanted, as numbers by the log's own formats."""
    formats, found, place = {128: (89, "FMT", "BBnNZ")}, {kind: [] for kind in KINDS}, 0
    while place + 3 <= len(data):
        if data[place : place + 2] != b"\xa3\x95" or data[place + 2] not in formats:
            place += 1
            continue
        size, kind, codes = formats[data[place + 2]]
        body, place = data[place + 3 : place + size], place + size
        if len(body) < size - 3 or kind not in ("FMT", *KINDS):
            continue
        values = struct.unpack("<" + "".join(CODES.get(c, c) for c in codes), body)
        if kind == "FMT":
            name, codes = (text.split(b"\0")[0].decode() for text in values[2:4])
            formats[values[0]] = values[1], name, codes
        else:
            found[kind].append([v * 0.01 if c in HUNDREDTHS else v for v, c in zip(values, codes, strict=True)])
    return {kind: np.array(each) for kind, each in found.items()}


log = rows(Path(LOG).read_bytes())
first, second, attitude = (log[kind] for kind in KINDS)
turned = Rotation.from_euler("ZYX", attitude[:, [6, 4, 2]], degrees=True)
angle = np.concatenate(([0.0], np.cumsum((turned[:-1].inv() * turned[1:]).as_rotvec()[:, 1])))
time = first[:, 0]
both = (time >= attitude[0, 0]) & (time <= attitude[-1, 0])
columns = (time * 1e-6, first[:, 2], second[:, 2], np.interp(time, attitude[:, 0], angle), first[:, 9])
np.savetxt(
    "copter.csv",
    np.column_stack(columns)[both],
    delimiter=",",
    header="time,gyro_y,second_y,angle_y,temperature",
    comments="",
    fmt="%.12g",
)
