"""A telephone that is carried along a way, its rates at 100 Hz beside the attitude that it tells itself.

The angles are summed up from the attitude, taken at the times of the rates.
"""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation


def read(name: str, columns: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Seconds and values of a file."""
    with Path(f"raw/{name}.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    time = np.array([int(row["time"]) for row in rows], dtype=np.int64)
    return time, np.array([[float(row[column]) for column in columns] for row in rows])


for name, folder in (("about", "1st Senario/past"),):
    time, gyro = read(f"{folder}/Gyroscope", ("x", "y", "z"))
    told, quaternion = read(f"{folder}/Orientation", ("qx", "qy", "qz", "qw"))
    start = min(time[0], told[0])
    seconds, seen = (time - start) * 1e-9, (told - start) * 1e-9
    attitude = Rotation.from_quat(quaternion)
    turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
    angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
    keep = (seconds > seen[0] + 5.0) & (seconds < seen[-1])  # its attitude settles at first
    for axis, letter in enumerate("xyz"):
        at = np.interp(seconds[keep], seen, angles[:, axis])
        table = np.column_stack([seconds[keep] - 5.0, at, gyro[keep, axis]])
        np.savetxt(
            f"{name}_{letter}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g"
        )
