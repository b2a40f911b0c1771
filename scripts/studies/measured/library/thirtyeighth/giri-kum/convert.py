"""A balancing robot that drives a course of turns: the heading of its inertial unit, and that of its wheels.

Rows are written with each step of its control, 100 a second by its program; both headings are unwrapped.
"""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/bin/imu.dat"), delimiter=",")
imu, wheels = np.degrees(np.unwrap(rows[:, 1:3], axis=0)).T
time = np.arange(len(rows)) / 100
table = np.column_stack([time, wheels, np.diff(imu, prepend=imu[0])])
np.savetxt("turns.csv", table, delimiter=",", header="time_s,wheels_deg,imu_step_deg", comments="", fmt="%.9g")
