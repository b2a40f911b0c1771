"""Accelerometer of a telephone on six faces with the turns between, as an application logs it twice a second."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

rows = loadmat(Path("raw/calibration/calibration.mat"), squeeze_me=True)["calibration"][1:]
table = np.array([[float(row[31]) / 1000, *map(float, row[:3])] for row in rows])
np.savetxt("faces.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
