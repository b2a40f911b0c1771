"""Gyros of a telephone beside the angle about the same axis of the body that OptiTrack follows, three runs.

The telephone's z is the body's y. The body's quaternion (x, y, z, w): what it turned about its y from row to row,
summed up, drawn straight between its rows at the telephone's stamps. Readings that the telephone wrote twice are left
out. The two clocks are left as they are.
"""

import numpy as np
from scipy.spatial.transform import Rotation

RUNS = {"y": ("imu-116-y", "opt-116-y"), "z": ("imu-116-z", "opt-116-z"), "all": ("imu", "optitrack")}


def once(time, *columns):
    new = np.concatenate(([True], np.diff(time) > 0))
    return time[new], *(column[new] for column in columns)


for run, (telephone, cameras) in RUNS.items():
    rows, poses = (np.loadtxt(f"raw/{name}.csv", delimiter=sep) for name, sep in ((telephone, ","), (cameras, None)))
    time, gyro = once(rows[:, 0] / 1e3, rows[:, 6])
    seen, quaternion = once(poses[:, 0], poses[:, 4:8])
    attitude = Rotation.from_quat(quaternion)
    turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 1]
    angle = np.interp(time, seen, np.concatenate(([0.0], np.cumsum(turned))))
    both = (time >= seen[0]) & (time <= seen[-1])
    np.savez(f"{run}.npz", t=(time - time[0])[both], gz=gyro[both], angle=angle[both])
