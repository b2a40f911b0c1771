"""Gyros and heading of a model satellite: each file has a row for the times and a row for each signal.

The heading counts clockwise, the gyros counter-clockwise.
"""

from pathlib import Path

import numpy as np


def rows(file):
    return np.array([[float(x) for x in line.split(",")] for line in (Path("raw") / file).read_text().splitlines()])


gyro, heading = rows("gyro.csv"), rows("io_data.csv")[2]
table = np.column_stack([gyro.T, -heading])
np.savetxt("satellite.csv", table, delimiter=",", header="time,gyro_x,gyro_y,gyro_z,angle", comments="", fmt="%.12g")
