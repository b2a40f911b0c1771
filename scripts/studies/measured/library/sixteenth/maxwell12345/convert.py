"""Rates of a BNO055 beside the rotations of its own quaternion.

A row is a time of day and the chip's registers from 0x08 on as bytes, low ones first: acceleration, field, rate (1/16
deg/s), Euler angles, quaternion (w first, 2^-14), more.

Source: Bosch, BNO055 data sheet BST-BNO055-DS000, register map.
"""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for run in (1, 2):
    with open(f"raw/data/{run}/IMUData.txt", encoding="ascii") as file:
        cells = [line.strip().strip(";").split(";") for line in file]
    rows = np.array([[int(cell) for cell in row] for row in cells if len(row) == 48])
    t = rows[:, :4] @ [3600.0, 60.0, 1.0, 1e-3]
    words = rows[:, 4:].astype(np.uint8).view("<i2").astype(float)
    angles = np.degrees(body_angles(Rotation.from_quat(words[:, [13, 14, 15, 12]])))
    table = np.column_stack([t - t[0], words[:, 6:9] / 16, angles])
    np.savetxt(f"run{run}.csv", table, delimiter=",", header="t,gx,gy,gz,ax,ay,az", comments="", fmt="%.9g")
