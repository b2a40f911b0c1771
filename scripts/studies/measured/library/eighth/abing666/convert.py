"""Gyro z of a unit in the hand beside what the owner's attitude (a quaternion) turned about the unit's own z."""

import csv

import numpy as np
from scipy.spatial.transform import Rotation

with open("raw/tests/load_csv_test/data/TDK_sample.csv", newline="") as file:
    rows = list(csv.DictReader(file))
stamp = np.array([int(row["timestamp"]) for row in rows])
attitude = Rotation.from_quat([[float(row[q]) for q in ("qx", "qy", "qz", "qw")] for row in rows])
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 2]
np.savez(
    "hand.npz",
    t=(stamp - stamp[0]) / 1e9,
    gz=np.array([float(row["wz"]) for row in rows]),
    angle=np.concatenate(([0.0], np.cumsum(turned))),
)
