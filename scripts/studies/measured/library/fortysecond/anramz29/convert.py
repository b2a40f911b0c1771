"""A VN-100 on a table, one row a second, from a ROS 2 bag; and one turned by hand beside its own quaternion.

A message of the bag holds two headers, a quaternion and nine numbers of covariance, three rates and nine more, and
three accelerations. Of the other log stands the rate about z.
"""

import sqlite3
import struct
from pathlib import Path

import numpy as np


def read(path: str) -> np.ndarray:
    rows = []
    with sqlite3.connect(path) as file:
        for (message,) in file.execute("select data from messages order by timestamp"):
            body, at = message[4:], 8
            seconds, nanoseconds = struct.unpack_from("<II", body)
            for skip in (8, 0):
                at += 4 + struct.unpack_from("<I", body, at)[0]
                at = (at + 3) // 4 * 4 + skip
            values = struct.unpack_from("<37d", body, (at + 7) // 8 * 8)
            rows.append([seconds + nanoseconds * 1e-9, *values[13:16], *values[25:28]])
    return np.array(rows)


held = read("raw/LAB3/src/data/Adrian_stationary/Adrian_stationary_0.db3")
table = np.column_stack([held[:, 0] - held[0, 0], held[:, 1:]])
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
np.savetxt("stands.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
log = Path("raw/Magnetometer_Comparison_Project/data/clearIMU.csv")
held = np.loadtxt(log, delimiter=",", skiprows=1)
time, q = held[:, 0] - held[0, 0], held[:, 1:5]
q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
(x, y, z, w), (dx, dy, dz, dw) = q.T, np.gradient(q, time, axis=0).T
table = np.column_stack([time, 2 * (w * dz - z * dw - x * dy + y * dx), held[:, 7]])
np.savetxt("about_z.csv", table, delimiter=",", header="time_s,rate,gyro", comments="", fmt="%.9g")
