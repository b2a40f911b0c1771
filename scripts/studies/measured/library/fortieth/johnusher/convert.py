"""A BNO055 with which a hand writes an O in the air: its gyros beside the rates that its own quaternion tells.

No times are told. The unit's attitude is renewed 100 times a second (its maker says so); the owner's programs say
"600 samples @5 ms update = 3 seconds", so the second manifest has 200 rows a second. Rates are those of a clock of
its own in each of the two tables.
"""

from pathlib import Path

import numpy as np

LETTERS = Path("raw/letters/O")


def table(name: str, axis: int, step: float) -> np.ndarray:
    q = np.loadtxt(LETTERS / name / "quaternion_data.txt")
    gyro = np.loadtxt(LETTERS / name / "gyro_data.txt")
    first = int(np.argmax(np.abs(q).sum(axis=1) > 0.5)) + 3
    q, gyro = q[first:], gyro[first:]
    time = np.arange(len(q)) * step
    q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
    (w, x, y, z), (dw, dx, dy, dz) = q.T, np.gradient(q, time, axis=0).T
    rates = (w * dx - x * dw - y * dz + z * dy, w * dy - y * dw - z * dx + x * dz, w * dz - z * dw - x * dy + y * dx)
    return np.column_stack([time, np.degrees(2 * rates[axis]), gyro[:, axis]])


head = "time_s,rate_deg_s,gyro_deg_s"
written = {"about_y.csv": ("O_20-32-39", 1, 0.01), "by_comment.csv": ("O_20-33-31", 1, 0.005)}
for file, (name, axis, step) in written.items():
    np.savetxt(file, table(name, axis, step), delimiter=",", header=head, comments="", fmt="%.9g")
