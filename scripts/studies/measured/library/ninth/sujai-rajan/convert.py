"""Gyro z of the VN-100 in the car beside its heading, and beside what its attitude turned about its own z.

The bag's messages hold the unit's line ($VNYMR) with yaw, pitch and roll. Times are those at which they were recorded.
"""

import numpy as np
from ros_bag import texts
from scipy.spatial.transform import Rotation
from turned import body_angles
from vectornav import sentence

log = np.array([(t, *sentence(body)) for t, body in texts("raw/LAB 4/data/data_going_in_circles.bag", b"VNYMR")])
attitude = Rotation.from_euler("ZYX", log[:, 1:4], degrees=True)
np.savetxt(
    "circles.csv",
    np.column_stack((log[:, 0] - log[0, 0], log[:, 12], log[:, 1], body_angles(attitude)[:, 2])),
    fmt="%.7f",
    delimiter=",",
    header="t,gz,yaw,angle_z",
    comments="",
)
