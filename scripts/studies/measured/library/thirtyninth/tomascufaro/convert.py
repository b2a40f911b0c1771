"""Accelerometer of an MPU-6050 at rest for its calibration, 89 readings; a row is taken as a second."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/accel_calibration.csv"), delimiter=",")
np.savetxt("rest.csv", rows, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.12g")
