"""A VN-100 that is carried about: gyros y and z beside the rates of its own quaternion, two minutes at 40 Hz."""

import csv
from pathlib import Path

import numpy as np

with Path("raw/LAB3/src/Analysis/csv_files/group_data.csv").open(newline="") as file:
    rows = list(csv.DictReader(file))
time = np.array([float(r[".Header.stamp.secs"]) + float(r[".Header.stamp.nsecs"]) * 1e-9 for r in rows])
time -= time[0]
q = np.array([[float(r[f".imu.orientation.{axis}"]) for axis in "xyzw"] for r in rows])
gyro = np.array([[float(r[f".imu.angular_velocity.{axis}"]) for axis in "xyz"] for r in rows])
q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
(x, y, z, w), (dx, dy, dz, dw) = q.T, np.gradient(q, time, axis=0).T
rates = {"y": 2 * (w * dy - y * dw - z * dx + x * dz), "z": 2 * (w * dz - z * dw - x * dy + y * dx)}
for axis, rate in rates.items():
    table = np.column_stack([time, rate, gyro[:, "xyz".index(axis)]])
    np.savetxt(f"about_{axis}.csv", table, delimiter=",", header="time_s,rate,gyro", comments="", fmt="%.9g")
