"""Six faces one after the other, a number for each: the readings of `raw/data/6_orientations` in their order."""

from pathlib import Path

import numpy as np

rows, start = [], 0.0
for k, face in enumerate(("x_axis_pos", "x_axis_neg", "y_axis_pos", "y_axis_neg", "z_axis_pos", "z_axis_neg")):
    table = np.genfromtxt(Path("raw/data/6_orientations") / f"{face}.csv", delimiter=",", skip_header=1)
    time = (table[:, 0] - table[0, 0]) / 1e3 + start
    rows.append(np.column_stack([time, table[:, 1:4], np.full(time.size, k)]))
    start = time[-1] + 5.0
names = "time,accel_x,accel_y,accel_z,face"
np.savetxt("faces.csv", np.concatenate(rows), delimiter=",", header=names, comments="", fmt="%.10g")
