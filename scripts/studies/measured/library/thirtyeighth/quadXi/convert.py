"""Gyro of a telephone that lies still, of half an hour the part in which nobody touches it.

Times [ms] come in clumps; rows that stand at one time with the row before are left out.
"""

from pathlib import Path

import numpy as np

FROM, TO = 560.0, 1230.0  # s
rows = np.loadtxt(Path("raw/gyro.csv"))
time = (rows[:, 0] - rows[0, 0]) / 1000
new = np.r_[True, np.diff(time) > 0.001]
table = np.column_stack([time, rows[:, 1:4]])[new & (time > FROM) & (time < TO)]
np.savetxt("rest.csv", table, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")
