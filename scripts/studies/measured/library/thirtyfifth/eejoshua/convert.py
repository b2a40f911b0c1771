"""Glasses that warm up: gyro and accelerometer (counts), one row a reading, beside the gyro's thermometer.

Every sensor has rows of its own in the log; the thermometer is read between its readings.
"""

import csv
from pathlib import Path

import numpy as np

found: dict[str, list[list[float]]] = {"gyro": [], "acc": [], "gyro_temp": []}
lines = Path("raw/epsilon_52Hz/CalibOverrideTest.csv").read_text(encoding="utf-8").splitlines()
for row in csv.reader(lines):
    if len(row) >= 5 and row[2] in found:
        found[row[2]].append([float(value) for value in row[3:7] if value])
gyro, accel, warmth = (np.array(rows) for rows in found.values())
at = gyro[:, 0]
if not np.array_equal(at, accel[:, 0]):
    raise SystemExit("gyro and accelerometer have times of their own")
table = np.column_stack([(at - at[0]) * 1e-6, gyro[:, 1:], accel[:, 1:], np.interp(at, *warmth[:, :2].T)])
np.savetxt("glasses.csv", table, delimiter=",", header="t,gx,gy,gz,ax,ay,az,temp", comments="", fmt="%.8g")
