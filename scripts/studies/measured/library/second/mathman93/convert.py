"""Heading by odometry: counts (16 bits that wrap), 508.8 to the turn of wheels of 72 mm, 235 mm apart."""

from pathlib import Path

import numpy as np

COUNT = np.pi * 0.072 / 508.8
TRACK = 0.235

for file in Path("raw").rglob("*.txt"):
    log = np.genfromtxt(file, delimiter=",")
    left, right = (np.unwrap(log[:, k], period=65536.0) * COUNT for k in (12, 13))
    table = np.column_stack([log[:, 0], log[:, 6], np.degrees(right - left) / TRACK])
    name = file.stem.removeprefix("IMU_Data_").lower()
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro_z,heading", comments="", fmt="%.6f")
