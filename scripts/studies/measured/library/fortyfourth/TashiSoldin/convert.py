"""An IMU of a course beside the attitude that its own filter tells, carried about; rows as its program read them.

Angles are summed up from the quaternion; rows whose time does not go on are left out.
"""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

NAMES = ("Time", "Quat X", "Quat Y", "Quat Z", "Quat W", "Gyro X (dps)", "Gyro Y (dps)", "Gyro Z (dps)")
with Path("raw/Progress Report 01/Code/decompressed_decrypted_data.csv").open(encoding="utf-8") as file:
    rows = list(csv.DictReader(file))
held = np.array([[float(row[name]) for name in NAMES] for row in rows])
held = held[np.concatenate(([True], np.diff(np.maximum.accumulate(held[:, 0])) > 0))]
held = held[: np.flatnonzero(np.diff(held[:, 0]) > 5.0)[0] + 1]
attitude = Rotation.from_quat(held[:, 1:5])
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
for axis, name in enumerate("xyz"):
    table = np.column_stack([held[:, 0] - held[0, 0], angles[:, axis], held[:, 5 + axis]])
    np.savetxt(f"about_{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
