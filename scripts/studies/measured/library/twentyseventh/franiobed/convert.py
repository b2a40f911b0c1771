"""Gyros of two of the five sensors of a suit: a row each in turn, its number, four of attitude, three of the gyros."""

from pathlib import Path

import numpy as np

RAW = Path("raw/Magisterka/csv")

lines = (RAW / "PrioData_idle2.csv").read_text(encoding="utf-8").splitlines()
rows = np.array([[float(v) for v in line.split(";")] for line in lines[1:] if line.count(";") == 13])
for sensor, out in ((3, "third.csv"), (5, "fifth.csv")):
    gyros = rows[rows[:, 0] == sensor][:, 5:8]
    np.savetxt(out, gyros, delimiter=",", header="gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")
