"""The gyros of each turn in a file of its own: a run each."""

import numpy as np
from scipy.io import loadmat

turns = loadmat("raw/gyro_calibration/measured_angular_rates.mat")
for axis in "xyz":
    rates = turns[f"{axis}_rotation"]
    np.savetxt(f"{axis}.csv", rates, delimiter=",", header="gyro_x,gyro_y,gyro_z", comments="", fmt="%.6f")
