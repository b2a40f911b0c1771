"""Simulated walks and drives of a book on positioning: gyros with errors beside what they are made of."""

from pathlib import Path

import numpy as np

HERE = Path("raw/data/sim")
for name, folder in (("square", "ch6_wheel_odom_square"), ("walk", "ch6_pdr_corridor_walk")):
    here = HERE / folder
    time, gyro, true = (np.loadtxt(here / f"{part}.txt") for part in ("time", "gyro", "gyro_clean"))
    table = np.column_stack([time, gyro, true[:, 2]])
    header = "time,gyro_x,gyro_y,gyro_z,true_rate_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
