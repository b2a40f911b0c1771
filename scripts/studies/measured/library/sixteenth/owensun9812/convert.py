"""Rates of a VN-100 that is turned by hand, beside the rotations of its own attitude in the same line ($VNYMR)."""

import csv

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles
from vectornav import ATTITUDE, RATES, sentence

for run, folder in enumerate(("teamstart", "teamstart1", "teamstart2")):
    with open(f"raw/LAB3/Data/{folder}/imu.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    t = np.array([float(r["header.stamp.secs"]) + 1e-9 * float(r["header.stamp.nsecs"]) for r in rows])
    numbers = np.array([sentence(r["raw"].encode()) for r in rows])
    angles = body_angles(Rotation.from_euler("ZYX", numbers[:, ATTITUDE], degrees=True))
    table = np.column_stack([t - t[0], numbers[:, RATES], angles])
    np.savetxt(f"run{run}.csv", table, delimiter=",", header="t,gx,gy,gz,ax,ay,az", comments="", fmt="%.9g")
