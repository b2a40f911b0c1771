"""Rows at which the unit turns by less than 12 deg/s, every fourth of them, each an attitude."""

import numpy as np

rows = np.loadtxt("raw/imu_data.txt")
slow = rows[np.linalg.norm(rows[:, 4:7], axis=1) < 12.0][::4]
np.savetxt("attitudes.csv", slow[:, 1:4], fmt="%.9g", delimiter=",", header="ax,ay,az", comments="")
