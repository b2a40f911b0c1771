"""Two units on an arm: gyros in deg/s beside what their own attitudes turned about their axes.

The quaternions turn from the world to the body.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

with (Path("raw/test/tst_data") / "data8_onArmAbductionFromTposeAndBack.csv").open() as file:
    names = file.readline().strip().split(",")
    rows = np.array([[float(cell) for cell in line.split(",")[: len(names)]] for line in file if line.strip()])
at = {name: rows[:, k] for k, name in enumerate(names)}
for unit in (0, 1):
    quaternion = np.column_stack([at[f"IMU_QUATERNION({unit})_{k}"] for k in (1, 2, 3, 0)])
    gyros = [at[f"IMU_GYROSCOPE({unit})_{k}"] for k in range(3)]
    angles = body_angles(Rotation.from_quat(quaternion).inv())
    table = np.column_stack([at[f"IMU_TIMESTAMP({unit})_0"], *gyros, angles])
    header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"unit{unit}.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
