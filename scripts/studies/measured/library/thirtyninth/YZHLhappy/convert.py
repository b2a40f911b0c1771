"""A navigation-grade unit at rest, 10 min at 64 Hz: seconds of the week, three rates, three accelerations."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

rows = loadmat(Path("raw/imubsp.mat"))["imudata"]
rows[:, 0] -= rows[0, 0]
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
np.savetxt("rest.csv", rows, delimiter=",", header=head, comments="", fmt="%.12g")
