"""A unit at rest for 3 s before a hand moves it; without a head."""

from pathlib import Path

import numpy as np

table = np.loadtxt(Path("raw/imudata.txt"), delimiter=",")
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("rest.csv", table[:290], delimiter=",", header=head, comments="", fmt="%.9g")
