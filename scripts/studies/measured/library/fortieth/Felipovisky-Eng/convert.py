"""An MPU-6050 in whole counts (2 g, 250 deg/s) that lies for 17 min, a row each half second, from the sixth second on.

In the first rows it is put down.
"""

from pathlib import Path

import numpy as np

rows = []
for line in Path("raw/DATALOG.TXT").read_text(encoding="latin-1").splitlines():
    words = line.split(",")
    if len(words) == 7:
        rows.append([float(word) for word in words])
table = np.array(rows)[10:]
table[:, 0] /= 1000
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("rest.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
