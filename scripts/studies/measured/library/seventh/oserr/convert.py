"""A telephone's rates beside the angles that its own attitude turns through.

The attitude is yaw, pitch, roll about z, x, y. The angle about a body axis is the sum of its part of the rotations
between rows. The files name two columns alike.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for name, path in (("walk", "exp1/exp1-1"), ("car", "exp3/exp3-3")):
    data = np.loadtxt(f"raw/data/ios/{path}.csv", delimiter=",", skiprows=1, usecols=range(7))
    attitude = Rotation.from_euler("ZXY", data[:, [3, 2, 1]])
    angle = body_angles(attitude)
    rows = np.column_stack([data[:, 0] - data[0, 0], data[:, 4:7], angle])
    names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"{name}.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
