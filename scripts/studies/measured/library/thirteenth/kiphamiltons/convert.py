"""Rates beside the angles that the filter's attitude (w, x, y, z) turned about the unit's own axes."""

import numpy as np
from scipy.spatial.transform import Rotation


def turned(quaternions):
    attitude = Rotation.from_quat(quaternions)
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))


rates = np.loadtxt("raw/gyroscope.csv", delimiter=",")
angles = turned(np.loadtxt("raw/quaternion.csv", delimiter=",")[:, [1, 2, 3, 0]])
np.savetxt(
    "turned.csv",
    np.hstack((rates, angles)),
    fmt="%.9f",
    delimiter=",",
    header="gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
