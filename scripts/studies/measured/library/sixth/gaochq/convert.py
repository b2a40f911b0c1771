"""Roll, pitch, yaw of the navigation unit as angles about the body axes, beside the gyros (all in radians).

The angle about a body axis is the sum of its part of the rotations between rows. The files are text without times.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for name in ("NAV", "NAV2"):
    data = np.loadtxt(f"raw/datasets/{name}_data.bin")
    attitude = Rotation.from_euler("ZYX", data[:, [11, 10, 9]])
    angle = body_angles(attitude)
    names = "gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    rows = np.column_stack([data[:, 3:6], angle])
    np.savetxt(f"{name.lower()}.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
