"""VN-100 in a car that drives circles: gyros beside what the unit's own attitude turned about their axes."""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

with (Path("raw/LAB4/src/data/data_going_in_circles") / "imu.csv").open() as file:
    rows = list(csv.DictReader(file))
stamp = np.array([int(row["Header.stamp.secs"]) + 1e-9 * int(row["Header.stamp.nsecs"]) for row in rows])
gyro = np.array([[float(row[f"IMU.angular_velocity.{axis}"]) for axis in "xyz"] for row in rows])
quaternion = np.array([[float(row[f"IMU.orientation.{part}"]) for part in "xyzw"] for row in rows])
table = np.column_stack([stamp - stamp[0], gyro, body_angles(Rotation.from_quat(quaternion))])
header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("circles.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
