"""Gyros on a record player, in its placings about the z axis: two recordings join the rows in which it stands or turns.

The player runs at 33 1/3 and 45 rev/min; z points down, so that the rate is negative. No times are given.
"""

from pathlib import Path

import numpy as np

HERE = Path("raw/example_data")
#: File, first row, last row, rev/min
PLACINGS = (
    ("33RPMgyr.txt", 7000, 7100, 0.0),
    ("33RPMgyr.txt", 0, 400, -100.0 / 3.0),
    ("33RPMgyr.txt", 700, 900, -100.0 / 3.0),
    ("45RPMgyr.txt", 3000, 3200, 0.0),
    ("45RPMgyr.txt", 300, 700, -45.0),
    ("45RPMgyr.txt", 6900, 7400, -45.0),
    ("45RPMgyr.txt", 8300, 9000, -45.0),
)
parts = []
for name, first, last, speed in PLACINGS:
    gyro = np.loadtxt(HERE / name)[first:last, 2]
    parts.append(np.column_stack([gyro, np.full(gyro.size, speed)]))
rows = np.concatenate(parts)
np.savetxt("turntable.csv", rows, delimiter=",", header="gyro_z,turntable_rpm", comments="", fmt="%.8g")
