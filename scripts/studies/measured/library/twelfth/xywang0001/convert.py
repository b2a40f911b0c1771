"""Counts of a hand-held IMU beside the angles about its axes by motion capture, at the IMU's times.

The file's order of gyros is
z, x, y. Pictures in which the unit was not seen are left out.
"""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation
from turned import body_angles

for run in (1, 2, 3):
    imu, capture = loadmat(f"raw/imu/imuRaw{run}.mat"), loadmat(f"raw/vicon/viconRot{run}.mat")
    matrices = np.moveaxis(capture["rots"], 2, 0)
    seen = np.isfinite(matrices).all(axis=(1, 2))
    attitude = Rotation.from_matrix(matrices[seen])
    angle = body_angles(attitude)
    known, time = capture["ts"].ravel()[seen], imu["ts"].ravel()
    inside = (time >= known[0]) & (time <= known[-1])
    at = time[inside] - time[0]
    angles = [np.interp(time[inside], known, angle[:, k]) for k in range(3)]
    rows = np.column_stack([at, imu["vals"][[4, 5, 3]].T[inside], *angles])
    names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"run{run}.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
