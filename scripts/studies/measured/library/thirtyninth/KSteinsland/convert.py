"""What the unit of a helicopter tells that stands on the ground, 500 rows a second; the first rows hold nothing yet."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

rows = loadmat(Path("raw/4_kalman_filter/task_1/R_d_ground.mat"))["data"].T[3:, [0, 2, 4, 6]]
head = "time_s,pitch_rad_s,elevation_rad_s,travel_rad_s"
np.savetxt("ground.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
