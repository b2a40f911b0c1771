"""A navigation unit: increments of velocity [m/s] and angle [rad] in 5 ms as means, the faces over 0.1 s."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

STEP, ROWS = 0.005, 20
here = next(Path("raw").glob("*/AcclX.mat")).parent
accels = np.column_stack([np.ravel(loadmat(here / f"Accl{axis}.mat")[f"Accl{axis}"]) for axis in "XYZ"])
count = len(accels) // ROWS
means = accels[: count * ROWS].reshape(count, ROWS, 3).mean(axis=1) / STEP
table = np.column_stack([STEP * ROWS * np.arange(count), means])
np.savetxt("faces.csv", table, delimiter=",", header="time,accel_x,accel_y,accel_z", comments="", fmt="%.9g")
rows = np.loadtxt(next(Path("raw").glob("*/staticdata.txt")))
table = np.column_stack([rows[:, 0] - rows[0, 0], rows[:, 1:] / STEP])
header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt("parked.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
