"""A strapdown unit at rest, 3 s at 1 kHz, before what carries it starts.

Units are not told: a reading of the gyros is taken as degrees, one of the accelerometers as metres a second, of a
sample each.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

rows = loadmat(Path("raw/imu.mat"))["a"][:3000]
table = rows[:, [6, 0, 1, 2, 3, 4, 5]]
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
np.savetxt("rest.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
