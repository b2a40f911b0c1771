"""One of six units worn on a body: accelerometers in g and gyros in rad/s, a row every few hundredths of a second."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/outputs") / "2025-05-10 00_22_22 UTC.csv", delimiter=",")
worn = rows[rows[:, 1] == 4, 2:8]
header = "accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
np.savetxt("worn.csv", worn, delimiter=",", header=header, comments="", fmt="%.9g")
