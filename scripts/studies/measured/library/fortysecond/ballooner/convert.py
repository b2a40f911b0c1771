"""Rates of an MPU-6050 that lies still for a minute; the columns in the order of a time and three rates."""

from pathlib import Path

import numpy as np

held = np.loadtxt(Path("raw/data/Still/rawData.csv"), delimiter=",", skiprows=1)
table = held[:, [3, 0, 1, 2]]
np.savetxt("still.csv", table, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")
