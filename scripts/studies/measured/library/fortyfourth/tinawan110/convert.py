"""Rates of a watch on the wrist of a swimmer beside its own attitude in the same rows; angles are summed up from it."""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

NAMES = ["seconds_elapsed", *(f"rotationRate{a}" for a in "XYZ"), *(f"quaternion{a}" for a in "XYZW")]
with Path("raw/Back0626WristMotion.csv").open(encoding="utf-8") as file:
    held = np.array([[float(row[name]) for name in NAMES] for row in csv.DictReader(file)])
attitude = Rotation.from_quat(held[:, 4:8])
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
for axis, name in enumerate("xyz"):
    table = np.column_stack([held[:, 0] - held[0, 0], angles[:, axis], held[:, 1 + axis]])
    np.savetxt(f"about_{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
