"""An MPU-6050 in whole counts (2 g, 250 deg/s), zeroed by its program, at rest before it is turned.

Rows that the radio link has torn are no rows; no times are told.
"""

from pathlib import Path

import numpy as np

rows = []
for line in Path("raw/algorithm/acc_gyro2.csv").read_text(encoding="latin-1").splitlines()[1:]:
    words = line.split(",")
    if len(words) == 7 and words[0].isdigit():
        rows.append([float(word) for word in words])
table = np.array(rows)
head = "number,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("rest.csv", table[:84], delimiter=",", header=head, comments="", fmt="%.9g")
