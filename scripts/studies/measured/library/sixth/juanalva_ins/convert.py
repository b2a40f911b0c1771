"""Rates of a MicroStrain's filter beside the angles that the same filter turns through, both at the host's stamps.

The rates stand in the rows that have them, the quaternions in a second file; the angle about a body axis is the sum of
its part of the rotations between rows, read at the rates' times.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from turned import body_angles

HERE = Path("raw/06_05_2026/SC")


def table(name: str) -> tuple[list[str], list[list[str]]]:
    """Names and cells of what stands after DATA_START."""
    lines = (HERE / name).read_text().split("DATA_START\n")[1].splitlines()
    return lines[0].split(","), [line.split(",") for line in lines[1:]]


def read(name: str, words: tuple[str, ...]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Times [ns] and the columns whose names end so, of the rows that have them."""
    names, cells = table(name)
    at = [next(k for k, found in enumerate(names) if found.endswith(word)) for word in words]
    full = [cell for cell in cells if all(cell[k] for k in at)]
    return np.array([int(c[0]) for c in full]), np.array([[float(c[k]) for k in at] for c in full])


stamps, rate = read("imu_7.csv", ("estAngularRateX", "estAngularRateY", "estAngularRateZ"))
at, quaternion = read("cuatEst_7.csv", tuple(f"estOrientQuaternion[0-{k}]" for k in range(4)))
attitude = Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])
angle = body_angles(attitude)
inside = (stamps >= at[0]) & (stamps <= at[-1])
time, known = 1e-9 * (stamps[inside] - at[0]), 1e-9 * (at - at[0])
angles = [np.interp(time, known, angle[:, k]) for k in range(3)]
rows = np.column_stack([time, rate[inside], *angles])
names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("imu_7.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
