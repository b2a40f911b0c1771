"""An accelerometer that is carried, 400 rows in units of gravity, 20 a second by the owner's program."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/data/accel.csv"), delimiter=",", skiprows=1)
table = np.column_stack([np.arange(len(rows)) / 20, rows])
np.savetxt("walk.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
