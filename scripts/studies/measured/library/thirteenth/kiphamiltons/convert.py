"""Rates beside the angles that the filter's attitude (w, x, y, z) turned about the unit's own axes."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

rates = np.loadtxt("raw/gyroscope.csv", delimiter=",")
attitude = Rotation.from_quat(np.loadtxt("raw/quaternion.csv", delimiter=",")[:, [1, 2, 3, 0]])
np.savetxt(
    "turned.csv",
    np.hstack((rates, body_angles(attitude))),
    fmt="%.9f",
    delimiter=",",
    header="gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
