"""Two units on a leg that walks: the turn of each in the unit's own quaternions, at the rows of its gyro.

A row that is written twice is taken once; the rate is over two rows, from the one before to the one after.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_rates

RATE = 100.0


for unit, name in (("015_00B44916", "first"), ("010_00B4490A", "second")):
    lines = Path(f"raw/test_data/MT_2020-07-10_{unit}.txt").read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("PacketCounter"))
    rows = np.array([[float(cell) for cell in line.split("\t")[:14]] for line in lines[start + 1 :] if line.strip()])
    rows = rows[np.r_[True, np.diff(rows[:, 0]) != 0]]
    time = (rows[:, 0] - rows[0, 0]) % 65536 / RATE
    attitude = Rotation.from_quat(np.roll(rows[:, 10:14], -1, axis=1))
    table = np.column_stack([time[1:-1], body_rates(attitude, time), rows[1:-1, 4:7]])
    head = "time_s,turn_x,turn_y,turn_z,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
