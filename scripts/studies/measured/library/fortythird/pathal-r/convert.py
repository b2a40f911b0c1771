"""A VN-100 that stands on a table for 102 s, and one turned about by hand for 39 s, at 40 Hz, from lines of its own.

The axes point forward, right and down. The angles of the turned one are summed up from its own yaw, pitch and roll.
"""

import csv
import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

LINE = re.compile(r"\$VNYMR,([-+\d.,]+)\*")


def read(name: str) -> np.ndarray:
    rows = []
    with Path(f"raw/IMU/Data/{name}.csv").open(encoding="utf-8") as file:
        told_rows = list(csv.reader(file))[1:]
    for row in told_rows:
        told = LINE.search(row[-1])
        if told is not None:
            rows.append([int(row[2]) + int(row[3]) * 1e-9, *map(float, told[1].split(","))])
    held = np.array(rows)
    held[:, 0] -= held[0, 0]
    return held


still = read("imu_stat-imu")
still[:, 0] = np.arange(len(still)) / 40.0  # its own stamps do not move
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("stands.csv", still[:, [0, 7, 8, 9, 10, 11, 12]], delimiter=",", header=head, comments="", fmt="%.9g")
held = read("imu_mov-imu")
attitude = Rotation.from_euler("ZYX", held[:, 1:4], degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
table = np.column_stack([held[:, 0], angles[:, 1], held[:, 11]])
np.savetxt("about_y.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
