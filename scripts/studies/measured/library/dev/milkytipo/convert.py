"""Gyros, accelerometers and temperature of a log whose name cannot be typed everywhere; its rows have no time."""

from pathlib import Path

import numpy as np

(log,) = Path("raw").glob("*2018-3-29_IG-500N_007000927.txt")
rows = np.loadtxt(log, usecols=(6, 7, 8, 3, 4, 5, 12))
names = "gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,temperature"
np.savetxt("rest.csv", rows, delimiter=",", header=names, comments="", fmt="%.6g")
