"""Accelerometer of a rocket's computer on a bench beside a thermometer of whole degrees: 409 rows without a time."""

from pathlib import Path

import numpy as np

lines = Path("raw/DATALOG.TXT").read_text().splitlines()
held = np.array([[float(x) for x in line.split(",")] for line in lines if line.count(",") == 5])
table = np.column_stack([np.arange(len(held)), held[:, 3:6]])
np.savetxt("bench.csv", table, delimiter=",", header="row,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
