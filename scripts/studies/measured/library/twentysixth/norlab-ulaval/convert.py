"""Samples of a robot's gyros at rest [deg/s]."""

from pathlib import Path

import numpy as np

samples = np.load(next(Path("raw").rglob("calib.npy")))
np.savetxt("calib.csv", samples, delimiter=",", header="gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")
