"""Gyros of a telephone that hangs as a pendulum, without the rows that repeat an earlier time."""

import numpy as np

rows = np.loadtxt("raw/Gyroscope.csv", delimiter="\t", skiprows=1)
new = rows[:, 0] > np.maximum.accumulate(np.concatenate(([-np.inf], rows[:-1, 0])))
np.savetxt("swing.csv", rows[new], fmt="%.9g", delimiter=",", header="t,gx,gy,gz", comments="")
