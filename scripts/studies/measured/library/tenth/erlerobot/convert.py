"""Inertial messages out of the autopilot's binary logs: seconds, rad/s, m/s^2.

A message: A3 95, its type, its fields; messages of type 128 say what the others hold. Two units that were read
together stand in one row. Of the rover's log what lies between its knocks, 90 to 230 s, is kept; of two logs of a
copter at rest the quiet stretch, with the barometer's temperature (hundredths of degC) at the rows' times.
"""

import struct
from pathlib import Path

import numpy as np

SIZES = {"b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "n": "4s", "N": "16s", "Z": "64s"}
SIZES |= {"c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B", "q": "q", "Q": "Q", "d": "d"}


def messages(data, wanted):
    known, place, found = {128: (89, "FMT", "BB4s16s64s")}, 0, {name: [] for name in wanted}
    while place + 3 <= len(data):
        kind = data[place + 2]
        if data[place : place + 2] != b"\xa3\x95" or kind not in known:
            place += 1
            continue
        length, name, layout = known[kind]
        body = data[place + 3 : place + length]
        if len(body) + 3 < length:
            break
        if kind == 128:
            number, size, of, letters, _ = (x for x in struct.unpack("<" + layout, body))
            layout = "".join(SIZES[letter] for letter in letters.rstrip(b"\0").decode() if letter in SIZES)
            known[number] = (size, of.rstrip(b"\0").decode(), layout)
        elif name in found:
            found[name].append(struct.unpack("<" + layout, body)[:7])
        place += length
    return {name: np.array(rows, dtype=float) for name, rows in found.items()}


FIELDS = ["gx", "gy", "gz", "ax", "ay", "az"]
LOGS = {
    "copter41": "copter/22-12-2014/41",
    "copter83": "copter/31-3-2015/83",
    "motors": "copter/7-9-2014/4",
    "rover_still": "rover/2-8-2014/mpu9250-ms5611/3",
    "rover_rest": "rover/25-8-2014/61",
}
for name, log in LOGS.items():
    held = messages(Path(f"raw/pxf/{log}.BIN").read_bytes(), ("IMU", "IMU2"))
    rows, names = held["IMU"], ["t", *FIELDS]
    rows[:, 0] = (rows[:, 0] - rows[0, 0]) / 1e3
    if held["IMU2"].size:
        rows, names = np.column_stack((rows, held["IMU2"][:, 1:])), [*names, *(f"{field}2" for field in FIELDS)]
    if name == "rover_rest":
        rows = rows[(rows[:, 0] >= 90.0) & (rows[:, 0] <= 230.0)]
    np.savetxt(f"{name}.csv", rows, fmt="%.8g", delimiter=",", header=",".join(names), comments="")

for name, log, first, last in (("warm51", "51", 164.0, 320.0), ("warm52", "52", 280.0, 870.0)):
    held = messages(Path(f"raw/pxf/copter/23-9-2014/{log}.BIN").read_bytes(), ("IMU", "BARO"))
    rows, baro = held["IMU"], held["BARO"]
    rows = np.column_stack((rows, np.interp(rows[:, 0], baro[:, 0], baro[:, 3] / 100.0)))
    rows[:, 0] = (rows[:, 0] - rows[0, 0]) / 1e3
    rows = rows[(rows[:, 0] >= first) & (rows[:, 0] <= last)]
    header = ",".join(["t", *FIELDS, "temperature"])
    np.savetxt(f"{name}.csv", rows, fmt="%.8g", delimiter=",", header=header, comments="")
