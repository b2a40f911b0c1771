"""Runs of a unit that is turned about one axis after the other, gyros beside what its own attitude has turned."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

HEADER = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
for file in sorted(Path("raw").glob("exp*/*.txt")):
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()[2:]
    rows = np.array([[float(x) for x in line.split(",")[:20]] for line in lines if line.count(",") >= 20])
    angle = body_angles(Rotation.from_quat(rows[:, [17, 18, 19, 16]]))
    table = np.column_stack([0.01 * (rows[:, 0] - rows[0, 0]), rows[:, 1:7], angle])
    np.savetxt(f"run{file.stem}.csv", table, delimiter=",", header=HEADER, comments="", fmt="%.10g")
