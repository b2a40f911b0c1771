"""Rates in counts beside the optical attitude as angles about the unit's own axes, read off at the unit's times.

Attitudes are made angles by the rotations from row to row in the axes of the body, summed up. The channels of the log
are three accelerations and the rates about z, x and y.
"""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

for run in (1, 2, 3):
    unit, optical = loadmat(f"raw/imu/imuRaw{run}.mat"), loadmat(f"raw/vicon/viconRot{run}.mat")
    time, seen = unit["ts"].ravel(), optical["ts"].ravel()
    turn = Rotation.from_matrix(np.moveaxis(optical["rots"], 2, 0)[: seen.size])
    angle = np.cumsum(np.vstack([np.zeros(3), (turn[:-1].inv() * turn[1:]).as_rotvec()]), axis=0)
    there = (time >= seen[0]) & (time <= seen[-1])
    angles = [np.interp(time[there], seen, a) for a in angle.T]
    counts = unit["vals"][[4, 5, 3]][:, there]
    table = np.column_stack([time[there] - time[0], *counts, *angles])
    head = "time,x,y,z,angle_x,angle_y,angle_z"
    np.savetxt(f"run{run}.csv", table, delimiter=",", header=head, comments="", fmt="%.12g")
