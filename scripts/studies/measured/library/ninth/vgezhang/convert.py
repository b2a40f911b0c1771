"""Gyro z of a wheeled robot beside the heading of its own quaternion, which insenv does not read."""

import csv

import numpy as np
from scipy.spatial.transform import Rotation

with open("raw/imu.txt", newline="") as file:
    rows = list(csv.DictReader(file))
stamp = np.array([int(row["field.header.stamp"]) for row in rows])
quaternion = np.array([[float(row[f"field.orientation.{axis}"]) for axis in "xyzw"] for row in rows])
np.savez(
    "robot.npz",
    t=(stamp - stamp[0]) / 1e9,
    gz=np.array([float(row["field.angular_velocity.z"]) for row in rows]),
    heading=np.unwrap(Rotation.from_quat(quaternion).as_euler("ZYX")[:, 0]),
)
