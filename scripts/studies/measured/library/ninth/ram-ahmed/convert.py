"""Rates of a VN-100 beside the angles that its own attitude turned about its own axes.

The attitude is the yaw, pitch and roll of the unit's message ($VNYMR): what it turned from row to row, summed up.
Times are those at which the rows arrived.
"""

import csv

import numpy as np
from scipy.spatial.transform import Rotation

with open("raw/LAB3/src/Analysis/moving_data.csv", newline="") as file:
    rows = [(float(row["Time"]), row["raw_data"].split("*")[0].split(",")) for row in csv.DictReader(file)]
time = np.array([t for t, _ in rows])
message = np.array([words[1:] for _, words in rows], float)
attitude = Rotation.from_euler("ZYX", message[:, :3], degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
np.savetxt(
    "hand.csv",
    np.column_stack((time - time[0], message[:, 9:12], angles)),
    fmt="%.7f",
    delimiter=",",
    header="t,gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
