"""Two of the autopilot's units as tables, until the motors take it off the ground (60 s).

An ArduPilot log is messages of two fixed bytes, a kind and data; messages of kind 128 say how the others are packed.
"""

import struct
from pathlib import Path

import numpy as np

PACKED = {"b": "b", "B": "B", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d", "q": "q", "Q": "Q"}
PACKED |= {"n": "4s", "N": "16s", "Z": "64s", "a": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i", "M": "B"}
COLUMNS = ("TimeUS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ", "T")

log = Path("raw/logs_from_flights/00000013.BIN").read_bytes()
kinds = {128: (89, "<BB4s16s64s")}
unit_kind, places, at, rows = -1, [], 0, []
while at + 3 <= len(log):
    if log[at : at + 2] != b"\xa3\x95" or log[at + 2] not in kinds:
        at += 1
        continue
    kind, (size, packed) = log[at + 2], kinds[log[at + 2]]
    if at + size > len(log):
        break
    if kind == 128:
        number, length, *texts = struct.unpack_from(packed, log, at + 3)
        name, form, labels = (t.rstrip(b"\0").decode("latin1") for t in texts)
        kinds[number] = (length, "<" + "".join(PACKED[letter] for letter in form))
        if name == "IMU":
            unit_kind, places = number, [labels.split(",").index(c) for c in ("I", *COLUMNS)]
    elif kind == unit_kind:
        values = struct.unpack_from(packed, log, at + 3)
        rows.append([values[place] for place in places])
    at += size
table = np.array(rows, dtype=float)
table[:, 1] = (table[:, 1] - table[0, 1]) / 1e6
head = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,temperature"
for unit in (0, 2):
    still = table[(table[:, 0] == unit) & (table[:, 1] < 60), 1:]
    np.savetxt(f"imu{unit}.csv", still, delimiter=",", header=head, comments="", fmt="%.9g")
