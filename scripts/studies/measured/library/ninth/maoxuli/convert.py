"""Rates of a hand-held unit beside the angles that its own attitude turned about its own axes.

The attitude is roll, pitch and yaw of the log's lines: what it turned from row to row, summed up. Times are the unit's
counter, milliseconds.
"""

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

NUMBER = re.compile(r"(?<![a-z])-?\d+(?:\.\d+)?")

lines = Path("raw/imu.txt").read_text().splitlines()
rows = np.array([[float(number) for number in NUMBER.findall(line)] for line in lines if line.strip()])
time, gyro, attitude = rows[:, 0] / 1e3, rows[:, 4:7], Rotation.from_euler("ZYX", rows[:, :-4:-1], degrees=True)
angles = body_angles(attitude)
np.savetxt(
    "hand.csv",
    np.column_stack((time, gyro, angles)),
    fmt="%.7f",
    delimiter=",",
    header="t,gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
