"""Accelerometers and gyros of one recording, which its owner keeps in two files, row by row."""

import numpy as np
from scipy.io import loadmat


def rows(name):
    table = loadmat(f"raw/srcs/IMU0x2D{name}.mat")
    return next(v for k, v in table.items() if not k.startswith("_"))


alpha, omega = rows("alpha"), rows("omega")
assert np.array_equal(alpha[:, 0], omega[:, 0])
both = np.column_stack([alpha, omega[:, 1:]])
np.savetxt("positions.csv", both, fmt="%.10g", delimiter=",", header="t,ax,ay,az,gx,gy,gz", comments="")
