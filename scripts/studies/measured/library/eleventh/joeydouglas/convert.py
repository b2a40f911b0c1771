"""Inertial messages of two units on one board out of an autopilot's binary logs: seconds, rad/s, m/s^2.

A message: A3 95, its type, its fields. Of the messages the logs' own formats tell type and length; IMU and IMU2 hold a
time in ms and six single-precision numbers. Rows of the two are paired by their number.
"""

import struct
from pathlib import Path

import numpy as np

FIELDS = ["gx", "gy", "gz", "ax", "ay", "az"]


def inertial(data):
    lengths, names, place, found = {128: 89}, {}, 0, {"IMU": [], "IMU2": []}
    while place + 3 <= len(data):
        kind = data[place + 2]
        if data[place : place + 2] != b"\xa3\x95" or kind not in lengths:
            place += 1
            continue
        body = data[place + 3 : place + lengths[kind]]
        if len(body) + 3 < lengths[kind]:
            break
        if kind == 128:
            lengths[body[0]], names[body[0]] = body[1], body[2:6].rstrip(b"\0").decode()
        elif names[kind] in found:
            found[names[kind]].append(struct.unpack("<I6f", body[:28]))
        place += lengths[kind]
    return (np.array(rows) for rows in found.values())


for name, log in {"flight1": "20-04-24", "flight2": "20-44-05", "flight3": "21-19-07"}.items():
    first, second = inertial(Path(f"raw/2014-10-18 {log}.bin").read_bytes())
    rows = np.column_stack(((first[:, 0] - first[0, 0]) / 1e3, first[:, 1:], second[:, 1:]))
    header = ",".join(["t", *FIELDS, *(f"{field}2" for field in FIELDS)])
    np.savetxt(f"{name}.csv", rows, fmt="%.8g", delimiter=",", header=header, comments="")
