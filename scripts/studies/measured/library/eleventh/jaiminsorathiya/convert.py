"""A topic's table with quaternions as it is written, beside it the yaw of the unit's own attitude."""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

(log,) = Path("raw").rglob("imu.csv")
with log.open(encoding="utf-8") as lines:
    table = csv.reader(lines)
    names = [name.lower() for name in next(table)]
    place = {
        end: next(i for i, name in enumerate(names) if name.endswith(end))
        for end in (
            "header.stamp.secs",
            "header.stamp.nsecs",
            *(f"orientation.{axis}" for axis in "xyzw"),
            "angular_velocity.z",
        )
    }
    rows = np.array([[float(row[i]) for i in place.values()] for row in table])
time = rows[:, 0] - rows[0, 0] + 1e-9 * rows[:, 1]
yaw = np.unwrap(Rotation.from_quat(rows[:, 2:6]).as_euler("ZYX")[:, 0])
table = np.column_stack((time - time[0], rows[:, 6], yaw))
np.savetxt("circle.csv", table, fmt="%.9g", delimiter=",", header="t,gz,yaw", comments="")
