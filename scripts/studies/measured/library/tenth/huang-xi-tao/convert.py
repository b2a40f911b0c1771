"""Rates of a unit in the hand beside the angles that its own attitude turned about its own axes."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

rows = np.genfromtxt("raw/imu_data.csv", delimiter=",", skip_header=1)
attitude = Rotation.from_quat(rows[:, 8:12])
angles = body_angles(attitude)
np.savetxt(
    "hand.csv",
    np.column_stack((rows[:, 1], rows[:, 5:8], angles)),
    fmt="%.8f",
    delimiter=",",
    header="t,gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
