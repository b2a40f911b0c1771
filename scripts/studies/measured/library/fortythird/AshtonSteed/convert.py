"""Gyro z of two Crazyflies that hover side by side, beside their angles by cameras, 10 s at 65 Hz."""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

with Path("raw/sittingtest.csv").open(encoding="utf-8") as file:
    rows = list(csv.DictReader(file))
for name, agent in (("second", "CF_2"), ("third", "CF_3")):
    own = [row for row in rows if row["agent_id"] == agent]
    time = np.array([float(row["t"]) for row in own])
    attitude = Rotation.from_quat([[float(row[k]) for k in ("mqx", "mqy", "mqz", "mqw")] for row in own])
    turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)[:, 2]
    angle = np.concatenate(([0.0], np.cumsum(turned)))
    gyro = np.array([float(row["r"]) for row in own])
    table = np.column_stack([time - time[0], angle, gyro])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
