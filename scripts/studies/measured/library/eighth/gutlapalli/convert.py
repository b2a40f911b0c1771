"""Gyro z of a VN-100 moved in the hand beside what its own attitude turned about its own z.

The messages of the ROS bag hold the line of the unit (VNYMR) with yaw, pitch and roll, the field, accelerations and
rates. Times are those at which they were recorded.
"""

import numpy as np
from ros_bag import texts
from scipy.spatial.transform import Rotation
from turned import body_angles
from vectornav import sentence

log = np.array([(t, *sentence(body)) for t, body in texts("raw/LAB3/src/Data/motion_data.bag", b"VNYMR")])
attitude = Rotation.from_euler("ZYX", log[:, 1:4], degrees=True)
angle = body_angles(attitude)[:, 2]
np.savez("hand.npz", t=log[:, 0] - log[0, 0], gz=log[:, 12], angle=angle)
