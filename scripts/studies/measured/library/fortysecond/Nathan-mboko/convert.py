"""An ICM-20649 that leans, 20333 rows without a time, each a line that names its values."""

import re
from pathlib import Path

import numpy as np

lines = Path("raw/data/Output25k.txt").read_text().splitlines()
held = np.array([[float(x) for x in re.findall(r"-?\d+\.\d+", line)] for line in lines])
table = np.column_stack([np.arange(len(held)), held])
head = "row,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("leans.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
