"""A robot of toy bricks that drives a bend: what its gyro has turned in a row [deg], and what its wheels tell.

Wheels of 43.2 mm, 97 mm apart as the owner's program says; the turn is positive as the gyro's. Times are not told: a
row is taken as a second. The gyro's angle is told in whole degrees.
"""

from pathlib import Path

import numpy as np

gyro, left, right = (np.loadtxt(Path("raw") / f"{name}.txt") for name in ("gyro", "motor_left", "motor_right"))
turn = (left - right) * 21.6 / 97
table = np.column_stack([np.arange(len(gyro)), turn, np.diff(gyro, prepend=gyro[0])])
np.savetxt("bend.csv", table, delimiter=",", header="time_s,wheels_deg,gyro_step_deg", comments="", fmt="%.9g")
