"""The log's sensor_combined as a table, of the last 57 s, after the autopilot was handled.

A ULog is a header of 16 bytes and messages of a length, a kind and data: A names a topic's number, D is a row of it.
"""

import struct
from pathlib import Path

import numpy as np

log = Path("raw/test/sample.ulg").read_bytes()
topic, at, rows = -1, 16, []
while at + 3 <= len(log):
    size, kind = struct.unpack_from("<HB", log, at)
    data = log[at + 3 : at + 3 + size]
    at += 3 + size
    if kind == ord("A") and data[3:] == b"sensor_combined":
        (topic,) = struct.unpack_from("<H", data, 1)
    elif kind == ord("D") and struct.unpack_from("<H", data)[0] == topic:
        rows.append(struct.unpack_from("<Q3f4xi3f", data, 2))
table = np.array(rows)
table[:, 0] /= 1e6
table = np.delete(table[table[:, 0] > table[-1, 0] - 57], 4, axis=1)
head = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt("bench.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
