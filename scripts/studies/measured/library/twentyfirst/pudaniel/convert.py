"""Means of three accelerometers in eighteen attitudes of a machined jig, one attitude a row."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

means = loadmat(Path("raw/IMU/Calibration_accelerometer") / "acc_calibration_data.mat")["f_acc"].T
np.savetxt("jig.csv", means, delimiter=",", header="accel_x,accel_y,accel_z", comments="", fmt="%.9g")
