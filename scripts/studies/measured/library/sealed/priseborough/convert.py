"""The inertial rows of an autopilot's log as a table: they stand in an archive, and the unit is moved after 30 s."""

import zipfile
from pathlib import Path

import numpy as np

REST = 30.0  # [s] from switch-on
NAMES = ("time", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")

with zipfile.ZipFile(Path("raw/code/InputFilesPX4_bench.zip")) as packed, packed.open("IMU.txt") as file:
    rows = np.loadtxt(file)[:, 1:]
rows[:, 0] *= 1e-3  # from milliseconds
np.savetxt("bench.csv", rows[rows[:, 0] < REST], delimiter=",", header=",".join(NAMES), comments="", fmt="%.9g")
