"""Gyro of a telephone as the mean between two rows of its magnetometer, and the heading that those give."""

from pathlib import Path

import numpy as np

RAW = Path("raw/data/exp2")

gyro = np.loadtxt(RAW / "Gyroscope.csv", delimiter=",", skiprows=1, converters=float)
field = np.loadtxt(RAW / "Magnetometer.csv", delimiter=",", skiprows=1, converters=float)
field = field[(field[:, 0] >= gyro[0, 0]) & (field[:, 0] <= gyro[-1, 0])]
turned = np.concatenate([[0.0], np.cumsum(0.5 * (gyro[1:, 3] + gyro[:-1, 3]) * np.diff(gyro[:, 0]))])
at = np.interp(field[:, 0], gyro[:, 0], turned)
rate = np.diff(at) / np.diff(field[:, 0])
heading = -np.unwrap(np.arctan2(field[:, 2], field[:, 1]))
table = np.column_stack([field[1:, 0], rate, heading[1:]])
np.savetxt("quarters.csv", table, delimiter=",", header="time,gyro_z,heading", comments="", fmt="%.9g")
