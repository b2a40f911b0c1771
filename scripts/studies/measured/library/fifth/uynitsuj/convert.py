"""A quadrotor's gyros (records IMU, 25 Hz) beside the angles that its attitude (ATT, 10 Hz) turns through.

The angle about a body axis is the sum of its part of the rotations between records, brought to the gyros' times.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

with open("raw/CSV/log100sel.csv") as file:
    records = [line.split(",") for line in file]
imu = np.array([[float(r[k]) for k in (1, 2, 3, 4)] for r in records if r[0] == "IMU"])
sent = np.array([[float(r[k]) for k in (1, 7, 5, 3)] for r in records if r[0] == "ATT"])
attitude = Rotation.from_euler("ZYX", sent[:, 1:], degrees=True)
angle = body_angles(attitude)
inside = imu[(imu[:, 0] >= sent[0, 0]) & (imu[:, 0] <= sent[-1, 0])]
angles = [np.interp(inside[:, 0], sent[:, 0], angle[:, k]) for k in range(3)]
rows = np.column_stack([1e-6 * inside[:, 0], inside[:, 1:], *angles])
names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("flight.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
