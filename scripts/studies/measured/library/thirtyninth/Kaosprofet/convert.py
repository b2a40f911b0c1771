"""What the unit of a helicopter on a bench tells while all stands still, 500 rows a second."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

log = loadmat(Path("raw/part4/data/part4_1_noise_stationary.mat"), squeeze_me=True)["fullYIMU"]
rows = log["signals"].item()["values"].item()[:, [1, 3, 5]]
table = np.column_stack([log["time"].item(), rows])
head = "time_s,pitch_rad_s,elevation_rad_s,travel_rad_s"
np.savetxt("stationary.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
