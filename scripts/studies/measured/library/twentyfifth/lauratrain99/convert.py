"""Four units on one plate: time [s], gyros [rad/s], accelerometers [m/s^2]."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

for unit in (1, 2, 3, 4):
    name = f"imu{unit}_raw"
    log = loadmat(Path("raw/real-data/static") / f"{name}.mat", squeeze_me=True, struct_as_record=False)[name]
    header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
    table = np.column_stack([log.t, log.wb, log.fb])
    np.savetxt(f"unit{unit}.csv", table, delimiter=",", header=header, comments="", fmt="%.8g")
