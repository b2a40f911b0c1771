"""A Sense HAT (ICM-20948) in counts on a table, 15000 rows without a time: before it is turned over, and afterwards."""

from pathlib import Path

import numpy as np

lines = Path("raw/Jasveer_Encryption/15k_data.txt").read_text().splitlines()[1:]
held = np.array([[float(x) for x in line.split()] for line in lines if len(line.split()) == 12])
for name, first, last in (("first", 1000, 9200), ("second", 11400, 15000)):
    table = np.column_stack([np.arange(last - first), held[first:last, 3:9]])
    head = "row,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
