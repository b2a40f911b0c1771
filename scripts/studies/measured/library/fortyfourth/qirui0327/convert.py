"""A WT901 moved by hand beside the angles that it tells itself, at 10 Hz; angles are summed up about its axes."""

import csv
from datetime import datetime
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

with Path("raw/imu.txt").open(encoding="utf-8") as file:
    rows = list(csv.DictReader(file))
time = np.array([(datetime.strptime(r["Time"], "%H:%M:%S.%f") - datetime(1900, 1, 1)).total_seconds() for r in rows])
gyro = np.array([[float(r[f"Gyro{a}_deg_per_s"]) for a in "XYZ"] for r in rows])
told = np.array([[float(r[f"Angle{a}_deg"]) for a in "ZYX"] for r in rows])
attitude = Rotation.from_euler("ZYX", told, degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
for axis, letter in enumerate("xyz"):
    table = np.column_stack([time - time[0], angles[:, axis], gyro[:, axis]])
    np.savetxt(f"about_{letter}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
