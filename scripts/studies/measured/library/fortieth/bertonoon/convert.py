"""A GY-521 in counts of 2/4096 g and 250/4096 deg/s, tilted by hand to 50 degrees and back, 65 s; without a head."""

from pathlib import Path

import numpy as np

lines = Path("raw/pomiary.csv").read_text(encoding="latin-1").replace("\t", "").splitlines()
table = np.array([[float(word) for word in line.split(",")[:7]] for line in lines if line.strip()])
table[:, 0] *= 0.00816
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("tilted.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
