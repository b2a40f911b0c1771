"""Logs of a telephone on a table: gyros and heading, without the hand at an end; rows are longer than their head."""

from pathlib import Path

import numpy as np

RAW = Path("raw/AccuracySurvey/data")
WANTED = ("time", "rad_vel_x", "rad_vel_y", "rad_vel_z", "rad_mag_z")

for name, start, end, out in (
    ("stop2", 0.4, 306.0, "stop"),
    ("turnTable1", 4.0, 300.0, "table"),
    ("turnTable2", 0.4, 540.0, "long_table"),
):
    lines = (RAW / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    heads = [head.strip() for head in lines[0].split(",")]
    columns = [heads.index(word) for word in WANTED]
    rows = np.array([[float(line.split(",")[k]) for k in columns] for line in lines[6:]])
    rows = rows[(rows[:, 0] >= start) & (rows[:, 0] <= end)]
    np.savetxt(f"{out}.csv", rows, delimiter=",", header="time,gyro_x,gyro_y,gyro_z,heading", comments="", fmt="%.9g")
