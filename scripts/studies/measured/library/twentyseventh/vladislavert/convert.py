"""Logs of a telephone from hand to hand, and the azimuth, counted clockwise, turned to the gyro's sense."""

from pathlib import Path

import numpy as np

RAW = Path("raw/resource")
WANTED = {
    "Time since": "time",
    "GYROSCOPE X": "gyro_x",
    "GYROSCOPE Y": "gyro_y",
    "GYROSCOPE Z": "gyro_z",
    "ACCELEROMETER X": "accel_x",
    "ACCELEROMETER Y": "accel_y",
    "ACCELEROMETER Z": "accel_z",
    "azimuth": "heading",
}

for name, start, end, out in (
    ("initCondition.csv", 0.5, 104.0, "still.csv"),
    ("music.csv", 0.5, 107.0, "music.csv"),
    ("longRotationYaw10.csv", 0.0, 60.0, "turned.csv"),
):
    lines = (RAW / name).read_text(encoding="utf-8", errors="replace").splitlines()
    heads = lines[0].split(",")
    columns = [next(k for k, head in enumerate(heads) if word in head) for word in WANTED]
    rows = np.array([[float(line.split(",")[k]) for k in columns] for line in lines[1:]])
    rows[:, 0] /= 1e3
    rows[:, 7] *= -1.0
    kept = (rows[:, 0] >= start) & (rows[:, 0] <= end) & np.r_[True, np.diff(rows[:, 0]) > 0]
    np.savetxt(out, rows[kept], delimiter=",", header=",".join(WANTED.values()), comments="", fmt="%.9g")
