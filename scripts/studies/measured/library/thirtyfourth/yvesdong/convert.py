"""A pan-tilt unit's log in two tables, of the rows in which time, position and velocity stand."""

from pathlib import Path

import numpy as np

log = np.genfromtxt(Path("raw/catkin_ws/src/ptu_mock/src/ptu_mock/resources/data.csv"), delimiter=",", skip_header=1)
for name, position, velocity in (("pan", 1, 3), ("tilt", 2, 4)):
    rows = log[:, [0, velocity, position]]
    rows = rows[np.isfinite(rows).all(axis=1)]
    rows = rows[np.r_[True, np.diff(rows[:, 0]) > 0]]
    np.savetxt(f"{name}.csv", rows, delimiter=",", header="time_s,velocity,position", comments="", fmt="%.9g")
