"""Gyro of a car that balances, beside the angle that its accelerometer tells: the first 9.9 s, before it is shaken.

By the owner's program a row is 2 ms, and a count of the gyro turns the angle by -1 / 14.6884 counts a row; the angle
goes from -8192 to 8191 counts once round.
"""

from pathlib import Path

import numpy as np

COUNT = 360 / 16384  # deg
lines = Path("raw/imu.txt").read_text(encoding="latin-1").split()
rows = np.array([line.rstrip(";").split(",") for line in lines], float)[:4960]
time = np.arange(len(rows)) * 0.002
table = np.column_stack([time, rows[:, 0] * COUNT, -rows[:, 1] / 14.6884 / 0.002 * COUNT])
np.savetxt("tilt.csv", table, delimiter=",", header="time_s,angle_deg,gyro_deg_s", comments="", fmt="%.9g")
