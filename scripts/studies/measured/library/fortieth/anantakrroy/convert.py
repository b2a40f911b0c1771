"""Accelerometer x of a simulated quadcopter that does nothing, as its graph logs it, at 200 Hz; without a head."""

from pathlib import Path

import numpy as np

table = np.loadtxt(Path("raw/accel.csv"), delimiter=",")
np.savetxt("accel.csv", table, delimiter=",", header="time_s,acc_x", comments="", fmt="%.9g")
