"""An MPU of a balloon's gondola on a bench for four hours, a row of counts a second, from the seventh minute on.

Before and after it is handled.
"""

import csv
from pathlib import Path

import numpy as np

with Path("raw/test4.csv").open(encoding="utf-8-sig", errors="replace") as lines:
    rows = [row[2:11] for row in list(csv.reader(lines))[1:] if len(row) > 14 and all(row[2:11])]
held = np.array([[float(x) for x in row] for row in rows])
time = held[:, 0] * 3600 + held[:, 1] * 60 + held[:, 2]
keep = (time > 67300) & (time < 81000)
table = np.column_stack([time - 67300, held[:, 3:]])[keep]
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("bench.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
