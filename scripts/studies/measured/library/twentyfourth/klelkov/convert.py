"""Robot with four steered wheels: its unit, and the turn rate that the speeds of its two sides tell.

Speeds of the wheels in rad/s, their radius and track as in the owner's filter.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

RADIUS, TRACK = 0.127, 0.625
NAMES = ("LocWx", "LocWy", "LocWz", "LocAx", "LocAy", "LocAz")
for name in ("eight", "nine", "square"):
    log = loadmat(Path("raw") / f"{name}.mat", squeeze_me=True)
    time = 1e-3 * (log["LocT"] - log["LocT"][0])
    rate = (log["LocOdoR"] - log["LocOdoL"]) * RADIUS / TRACK
    table = np.column_stack([time, *(log[column] for column in NAMES), rate])
    header = "time,gyro_up,gyro_y,gyro_z,accel_x,accel_y,accel_z,wheels_rate"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
