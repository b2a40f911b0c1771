"""Means of the stretches in which the gyros (deg/s) are still; rows are three little-endian doubles."""

import numpy as np

accel = np.fromfile("raw/data/rawAccel3").reshape(-1, 3)
gyro = np.fromfile("raw/data/rawGyro3").reshape(-1, 3)
still = np.linalg.norm(gyro - (-2.1, 0.45, 0.1), axis=1) < 3.0
edges = np.flatnonzero(np.diff(np.concatenate(([0], still.astype(int), [0]))))
means = [accel[a + 3 : b - 3].mean(axis=0) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 15]
np.savetxt("rests.csv", means, fmt="%.7f", delimiter=",", header="ax,ay,az", comments="")
