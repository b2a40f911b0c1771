"""Gyro of a telephone at 50 Hz: on a table for 16 s, and on somebody who has lain down, 13 s.

Times in nanoseconds.
"""

from pathlib import Path

import numpy as np

held = np.loadtxt(Path("raw/gyro.csv"), delimiter=",")
time = (held[:, 0] - held[0, 0]) * 1e-9
for name, first, last in (("table", 0.0, 15.9), ("lies", 30.0, 43.0)):
    keep = (time >= first) & (time < last)
    table = np.column_stack([time[keep] - first, held[keep, 1:4]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")
