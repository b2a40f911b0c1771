"""VN-100 at rest, outside and in a car: arrays of time, attitude, quaternion, accelerometers and gyros.

Yaw counts clockwise, as the gyro about z (downwards) does. The first file counts microseconds.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

NAMES = {"stationary_imu_data": "rest", "stationary_outside_imu": "outside", "testdrive_imu": "drive"}
HEADER = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,yaw"
for stem, name in NAMES.items():
    rows = loadmat(Path("raw/lab3/MATLAB files") / f"{stem}.mat")["data"]
    time = rows[:, 0] * (1e-6 if name == "rest" else 1.0)
    table = np.column_stack([time - time[0], rows[:, 7:13], np.unwrap(rows[:, 1], period=360.0)])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=HEADER, comments="", fmt="%.10g")
