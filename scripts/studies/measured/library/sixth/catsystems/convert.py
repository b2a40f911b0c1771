"""Rows of three units in turn, told by their names, as a table: the first unit beside the second."""

import csv
from pathlib import Path

import numpy as np

FILES = {
    "piccard": Path("raw/Aris-Piccard/CATS/raw/Picccard - imu_raw.csv"),
    "euler": Path("raw/Aris-Euler/CATS/CATS_processed_data/euler_explosion - imu_processed.csv"),
}

for name, path in FILES.items():
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    by_time: dict[float, dict[str, list[float]]] = {}
    for row in rows:
        by_time.setdefault(float(row["ts"]), {})[row["id"]] = [float(row[c]) for c in ("Gx", "Gy", "Gz")]
    both = [(t, *units["IMU0"], *units["IMU1"]) for t, units in by_time.items() if {"IMU0", "IMU1"} <= units.keys()]
    header = "time," + ",".join(f"gyro{k}_{axis}" for k in (0, 1) for axis in "xyz")
    np.savetxt(f"{name}.csv", np.array(both), delimiter=",", header=header, comments="", fmt="%.12g")
