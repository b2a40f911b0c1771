"""Gyro z of a VN-100 beside its own yaw, which stands in the unit's line ($VNYMR), a field of the owner's table."""

import csv

import numpy as np

with open("raw/circle_data/circle_data_0_imu.csv", newline="") as file:
    rows = list(csv.DictReader(file))
time = np.array([float(row["t"]) for row in rows])
np.savez(
    "circles.npz",
    t=time - time[0],
    gz=np.array([float(row["gyro_z"]) for row in rows]),
    yaw=np.array([float(row["raw_vnymr"].split(",")[1]) for row in rows]),
)
