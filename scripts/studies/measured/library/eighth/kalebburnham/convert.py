"""Gyros of EuRoC MH_01 beside the angles of its published attitude, drawn straight between its rows.

This repository's own copy of the attitude is not stored whole: it is that of `decargroup`, which is laid out first.
"""

import numpy as np
from scipy.interpolate import interp1d

rows = np.genfromtxt("raw/mav0/imu0/data.csv", delimiter=",", usecols=range(4))
rows = rows[np.isfinite(rows).all(axis=1)]
truth = np.load("../decargroup/attitude.npz")
time = rows[:, 0] / 1e9
both = (time >= truth["t"][0]) & (time <= truth["t"][-1])
x, y, z = interp1d(truth["t"], truth["angles"], axis=0)(time[both]).T
gx, gy, gz = rows[both, 1:].T
np.savez("flight.npz", t=time[both] - time[both][0], gx=gx, gy=gy, gz=gz, angle_x=x, angle_y=y, angle_z=z)
