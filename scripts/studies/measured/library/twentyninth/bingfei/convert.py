"""Two units on a leg that walks: the turn of each in the unit's own quaternions, at the rows of its gyro.

A row that is written twice is taken once; the rate is over two rows, from the one before to the one after.
"""

from pathlib import Path

import numpy as np

RATE = 100.0


def body_rates(quaternions):
    """Rates about the body's axes from (w, x, y, z), without the first and the last row."""
    a, b = quaternions[:-2], quaternions[2:]
    w = (a * b).sum(1)
    v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    length = np.linalg.norm(v, axis=1)
    turned = 2 * np.arctan2(length, np.abs(w)) * np.sign(w)
    return v / (length + 1e-15)[:, None] * (turned * RATE / 2)[:, None]


for unit, name in (("015_00B44916", "first"), ("010_00B4490A", "second")):
    lines = Path(f"raw/test_data/MT_2020-07-10_{unit}.txt").read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("PacketCounter"))
    rows = np.array([[float(cell) for cell in line.split("\t")[:14]] for line in lines[start + 1 :] if line.strip()])
    rows = rows[np.r_[True, np.diff(rows[:, 0]) != 0]]
    time = (rows[:, 0] - rows[0, 0]) % 65536 / RATE
    table = np.column_stack([time[1:-1], body_rates(rows[:, 10:14]), rows[1:-1, 4:7]])
    head = "time_s,turn_x,turn_y,turn_z,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
