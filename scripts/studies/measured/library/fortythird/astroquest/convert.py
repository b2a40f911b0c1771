"""A telephone that is turned about by hand for 20 s, its rates as they come from the part, at 100 Hz.

The angle about y is summed up from its own attitude, taken at the times of the rates.
"""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation


def read(name: str, columns: tuple[str, ...]) -> np.ndarray:
    with Path(f"raw/Data/{name}.csv").open(encoding="utf-8") as file:
        return np.array([[float(row[column]) for column in columns] for row in csv.DictReader(file)])


gyro = read("GyroscopeUncalibrated", ("seconds_elapsed", "y"))
attitude = read("Orientation", ("seconds_elapsed", "qx", "qy", "qz", "qw"))
pose = Rotation.from_quat(attitude[:, 1:])
turned = (pose[:-1].inv() * pose[1:]).as_rotvec(degrees=True)
angle = np.concatenate(([0.0], np.cumsum(turned[:, 1])))
gyro = gyro[(gyro[:, 0] >= attitude[0, 0]) & (gyro[:, 0] <= attitude[-1, 0])]
table = np.column_stack([gyro[:, 0], np.interp(gyro[:, 0], attitude[:, 0], angle), gyro[:, 1]])
np.savetxt("about_y.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
