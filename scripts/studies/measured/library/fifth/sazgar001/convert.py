"""A VN-100's rate about z beside the yaw of its orientation, by the host's stamps.

The table has a column of text with line breaks.
"""

import csv

import numpy as np
from scipy.spatial.transform import Rotation

with open("raw/lab5/src/data/going_in_circles_imu.csv", newline="") as file:
    rows = list(csv.DictReader(file))
stamp = [float(row["header.stamp.secs"]) + 1e-9 * float(row["header.stamp.nsecs"]) for row in rows]
quaternion = [[float(row[f"imu.orientation.{k}"]) for k in "xyzw"] for row in rows]
yaw = np.unwrap(Rotation.from_quat(quaternion).as_euler("ZYX")[:, 0])
rate = [float(row["imu.angular_velocity.z"]) for row in rows]
table = np.column_stack([np.array(stamp) - stamp[0], rate, yaw])
np.savetxt("circles.csv", table, delimiter=",", header="time,gyro_z,yaw", comments="", fmt="%.15g")
