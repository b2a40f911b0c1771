"""Rates of a telephone on a boat at sea beside the attitude that it tells itself, at 100 Hz.

The file has gaps of minutes; what stands before the first one is taken. Angles are summed up from its attitude
(azimuth, pitch and roll in degrees), taken at the times of the rates.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation


def read(name: str) -> np.ndarray:
    """Seconds and values of a file."""
    held = np.loadtxt(Path(f"raw/data/{name}.csv"), delimiter=",")
    time = (held[:, 0] - 1696324304.0) + held[:, 1] * 1e-9
    held = np.column_stack([time, held[:, 2:]])
    return held[: np.flatnonzero(np.diff(time) > 5.0)[0] + 1]


gyro, told = read("ang"), read("att")
attitude = Rotation.from_euler("ZXY", np.column_stack([-told[:, 1], -told[:, 2], told[:, 3]]), degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
gyro = gyro[(gyro[:, 0] > told[0, 0]) & (gyro[:, 0] < told[-1, 0])]
for axis, name in enumerate("xyz"):
    at = np.interp(gyro[:, 0], told[:, 0], angles[:, axis])
    table = np.column_stack([gyro[:, 0] - gyro[0, 0], at, gyro[:, 1 + axis]])
    np.savetxt(f"about_{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
