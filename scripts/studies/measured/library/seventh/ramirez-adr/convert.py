"""Rates of a VN-100 beside the angles that its own attitude turns through, by the host's stamps.

The angle about a body axis is the sum of its part of the rotations between rows.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for name in ("clearIMU", "vn7Hard", "vn30HS"):
    path = f"raw/Magnetometer_Comparison_Project/data/{name}.csv"
    data = np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(8))
    attitude = Rotation.from_quat(data[:, 1:5])
    angle = body_angles(attitude)
    rows = np.column_stack([data[:, 0] - data[0, 0], data[:, 5:8], angle])
    names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"{name}.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
