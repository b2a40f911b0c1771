"""A hand-held IMU's counts beside motion capture, for the converters of a data set that several owners keep.

The angle about a body axis is the sum of its part of the rotations between the pictures. The file's order of gyros is
z, x, y. Pictures in which the unit was not seen are left out.
"""

from __future__ import annotations

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation
from turned import body_angles


def save(run: int) -> None:
    """Write ``runN.csv``: the gyros' counts and the angles about their axes [rad], at the IMU's times."""
    imu, capture = loadmat(f"raw/imu/imuRaw{run}.mat"), loadmat(f"raw/vicon/viconRot{run}.mat")
    matrices = np.moveaxis(capture["rots"], 2, 0)
    seen = np.isfinite(matrices).all(axis=(1, 2))
    angle = body_angles(Rotation.from_matrix(matrices[seen]))
    known, time = capture["ts"].ravel()[seen], imu["ts"].ravel()
    inside = (time >= known[0]) & (time <= known[-1])
    angles = [np.interp(time[inside], known, angle[:, k]) for k in range(3)]
    rows = np.column_stack([time[inside] - time[0], imu["vals"][[4, 5, 3]].T[inside], *angles])
    names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"run{run}.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
