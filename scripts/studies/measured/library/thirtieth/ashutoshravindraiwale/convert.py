"""Turn of a VN-100 in the hand from its own quaternions, over the two intervals about a row, beside its gyros."""

import csv
from io import StringIO
from pathlib import Path

import numpy as np

rows = list(csv.DictReader(StringIO(Path("raw/LAB3/Data/moving/imu.csv").read_text())))


def column(name: str) -> np.ndarray:
    return np.array([float(row[name]) for row in rows])


time = column("header.stamp.secs") + 1e-9 * column("header.stamp.nsecs")
q = np.column_stack([column(f"IMU.orientation.{axis}") for axis in "wxyz"])
gyro = np.column_stack([column(f"IMU.angular_velocity.{axis}") for axis in "xyz"])
a, b = q[:-2], q[2:]
v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
v *= np.sign((a * b).sum(1))[:, None]
turn = 2 * np.arcsin(np.clip(np.linalg.norm(v, axis=1), 0, 1))
rate = v / np.linalg.norm(v, axis=1)[:, None] * (turn / (time[2:] - time[:-2]))[:, None]
table = np.column_stack([time[1:-1] - time[0], rate, gyro[1:-1]])
head = "time_s,fused_x,fused_y,fused_z,gyro_x,gyro_y,gyro_z"
np.savetxt("hand.csv", table, delimiter=",", header=head, comments="", fmt="%.7g")
