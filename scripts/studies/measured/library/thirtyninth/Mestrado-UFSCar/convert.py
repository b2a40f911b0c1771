"""A telephone that is carried, 196 s at 50 Hz."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

held = loadmat(Path("raw/imuData.mat"))
table = np.column_stack([held["t"].ravel(), held["g"].T, held["a"].T])
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
np.savetxt("carried.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
