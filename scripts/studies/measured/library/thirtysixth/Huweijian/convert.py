"""A robot on four omni wheels: its gyros, and its turn by least squares over the wheels' counts.

Counts become mm/s by the factors of the owner's program, which also says how the wheels stand. Times are the log's
milliseconds, which begin anew after 65535. The turn is positive as the gyro's z.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

#: Directions in which the wheels drive [deg], and their distance from the middle [mm]
DIRECTIONS, RADIUS = (55, -55, -128, 128), 82
LOGS = (("data2", "data2"), ("AHuaData", "ahua"), ("data_quite", "quite"))

drive = np.array([[np.sin(np.radians(a)), np.cos(np.radians(a)), 1] for a in DIRECTIONS])
inverse = np.linalg.pinv(drive)
for log, name in LOGS:
    rows = loadmat(Path("raw") / f"{log}.mat")["m"][1:]
    step = np.mod(np.diff(rows[:, 0]) + 65535, 65535) / 1000
    wheels = rows[:, 1:5] / 128 / 74.037 * 1000  # mm/s
    turn = wheels @ inverse[2] / RADIUS * 180 / np.pi * -1
    table = np.column_stack([np.r_[0, np.cumsum(step)], turn, rows[:, 8:11]])
    head = "time_s,wheel_rate_deg_s,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.10g")
