"""Rates of a VN-100 beside the angles that its own attitude turned about its own axes.

The attitude is that of the unit's sentence: what it turned from row to row, summed up. Times are those at which the
rows arrived.
"""

import csv

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles
from vectornav import ATTITUDE, RATES, sentence

with open("raw/LAB3/src/Analysis/moving_data.csv", newline="") as file:
    rows = [(float(row["Time"]), sentence(row["raw_data"].encode())) for row in csv.DictReader(file)]
time = np.array([t for t, _ in rows])
told = np.array([numbers for _, numbers in rows])
angles = body_angles(Rotation.from_euler("ZYX", told[:, ATTITUDE], degrees=True))
np.savetxt(
    "hand.csv",
    np.column_stack((time - time[0], told[:, RATES], angles)),
    fmt="%.7f",
    delimiter=",",
    header="t,gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
