"""What the unit of a helicopter tells that stands on the ground, 500 rows a second by its program."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

(rows,) = (v for k, v in loadmat(Path("raw/Noise_measurements_ground.mat")).items() if not k.startswith("__"))
table = np.column_stack([np.arange(len(rows)) / 500, rows[:, [1, 3, 5]]])
head = "time_s,pitch_rad_s,elevation_rad_s,travel_rad_s"
np.savetxt("ground.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
