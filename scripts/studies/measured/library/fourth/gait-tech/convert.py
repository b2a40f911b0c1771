"""Gyro x of a unit on a leg beside what its own orientation turned about x."""

import numpy as np
from scipy.spatial.transform import Rotation

LOG = "raw/data/sample/rawimu/S02-Trial-Walk-1-000_00B40C49.txt"
RATE = 100.0  # [Hz]
gyro, *quaternion = np.genfromtxt(LOG, delimiter=",", skip_header=6, usecols=(5, 12, 13, 14, 11)).T
attitude = Rotation.from_quat(np.column_stack(quaternion))
angle = np.concatenate(([0.0], np.cumsum((attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 0])))
time = np.arange(gyro.size) / RATE
np.savetxt(
    "leg.csv",
    np.column_stack((time, gyro, angle)),
    delimiter=",",
    header="time,gyro_x,angle_x",
    comments="",
    fmt="%.12g",
)
