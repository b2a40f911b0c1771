"""Gyro about x as it is, and the tilt about x that the accelerometers give, at the gyro's times."""

from pathlib import Path

import numpy as np

RAW = Path("raw/data")

gyro = np.loadtxt(RAW / "gyro.csv", delimiter=",", skiprows=1, usecols=(1, 2))
force = np.loadtxt(RAW / "acc.csv", delimiter=",", skiprows=1, usecols=(1, 2, 3, 4))
tilt = np.interp(gyro[:, 0], force[:, 0], np.arctan2(force[:, 2], force[:, 3]))
table = np.column_stack([gyro[:, 0] / 1e3, gyro[:, 1], tilt])
np.savetxt("tilt.csv", table, delimiter=",", header="time,gyro_x,tilt", comments="", fmt="%.9g")
