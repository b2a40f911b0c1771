"""Gyro z of the VN-100 in a car beside its own yaw.

The messages of the ROS bag hold the line of the unit (VNYMR) with yaw, pitch and roll, the field, accelerations and
rates. Times are those at which they were recorded.
"""

import numpy as np
from ros_bag import texts
from vectornav import sentence

log = np.array([(t, *sentence(body)) for t, body in texts("raw/Lab 4/src/analysis/circle_data.bag", b"VNYMR")])
np.savez("circles.npz", t=log[:, 0] - log[0, 0], gz=log[:, 12], yaw=log[:, 1])
