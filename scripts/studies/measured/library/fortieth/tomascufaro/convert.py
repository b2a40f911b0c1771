"""An MPU-6050 that lies for the calibration of its accelerometer, 89 rows; without a head."""

from pathlib import Path

import numpy as np

table = np.loadtxt(Path("raw/accel_calibration.csv"), delimiter=",")
np.savetxt("lies.csv", table, delimiter=",", header="row,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
