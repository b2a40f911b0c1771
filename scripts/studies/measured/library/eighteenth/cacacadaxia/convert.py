"""Rates of a drone beside the angles that its tracked attitude (w, x, y, z) turned about its axes."""

import numpy as np
from scipy.io import loadmat


def body_angles(x, y, z, w):
    """What a body turned about each of its own axes, summed up from row to row."""
    a = np.column_stack([w, x, y, z])
    a /= np.linalg.norm(a, axis=1)[:, None]
    p, q = a[:-1] * [1, -1, -1, -1], a[1:]
    real = p[:, 0] * q[:, 0] - (p[:, 1:] * q[:, 1:]).sum(1)
    turn = p[:, :1] * q[:, 1:] + q[:, :1] * p[:, 1:] + np.cross(p[:, 1:], q[:, 1:])
    turn *= np.sign(real)[:, None]
    size = np.linalg.norm(turn, axis=1)
    share = np.where(size > 1e-12, 2 * np.arctan2(size, np.abs(real)) / np.maximum(size, 1e-12), 2.0)
    return np.vstack([np.zeros(3), np.cumsum(turn * share[:, None], axis=0)])


table = loadmat("raw/ImuFusion-master/data/attitude_data.mat")
unit, truth = table["imu_data"], table["grt_data"]
angles = body_angles(*truth[:, [5, 6, 7, 4]].T)
time, at = (unit[:, 0] - unit[0, 0]) * 1e-9, (truth[:, 0] - unit[0, 0]) * 1e-9
beside = [np.interp(time, at, a) for a in angles.T]
np.savetxt(
    "turned.csv",
    np.column_stack([time, unit[:, 1:4], *beside]),
    fmt="%.9g",
    delimiter=",",
    header="t,gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
