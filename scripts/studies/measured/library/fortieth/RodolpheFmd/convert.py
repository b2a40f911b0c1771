"""An inertial unit at 500 Hz, the first 72 s, in which it stands; steps of 1e-3 g and 0.01 deg/s."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

held = loadmat(Path("raw/IMU_data.mat"), squeeze_me=True)
table = np.column_stack([held[f"{kind}{axis}"] for kind in ("fb", "wb") for axis in "xyz"])[:36000]
time = np.arange(len(table)) / 500
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("rest.csv", np.column_stack([time, table]), delimiter=",", header=head, comments="", fmt="%.9g")
