"""A unit on a turntable: its rows before the table turns, accelerometers in 9.8 m/s^2, gyros in deg/s."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

rows = loadmat(next(Path("raw/work2").glob("5*.mat")))["temp_data"][:60000]
header = "accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
np.savetxt("still.csv", rows, delimiter=",", header=header, comments="", fmt="%.6g")
