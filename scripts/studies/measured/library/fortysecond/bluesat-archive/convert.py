"""An MPU-9250 of a balloon's payload on a bench, two minutes; times of whole seconds, so rows stand for even times."""

from pathlib import Path

import numpy as np

lines = Path("raw/MPU9250/data/0205AM_13-02-18.csv").read_text().splitlines()[1:]
held = np.array([[float(x) for x in line.split(",")[2:8]] for line in lines])
table = np.column_stack([np.arange(len(held)) / 2, held])
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("bench.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
