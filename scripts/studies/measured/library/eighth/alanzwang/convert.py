"""Gyro z of a VMU931 beside the yaw of its quaternion, which has a log of its own, drawn straight between its rows."""

import numpy as np
from scipy.spatial.transform import Rotation

gyro, attitude = (
    np.loadtxt(f"raw/{name}_20180927_100324.csv", delimiter=",", usecols=range(1, columns))
    for name, columns in (("gyroscope", 5), ("quaternion", 6))
)
yaw = np.unwrap(Rotation.from_quat(attitude[:, [2, 3, 4, 1]]).as_euler("ZYX")[:, 0])
both = (gyro[:, 0] >= attitude[0, 0]) & (gyro[:, 0] <= attitude[-1, 0])
time = gyro[both, 0]
np.savez("hand.npz", t=(time - time[0]) / 1e3, gz=gyro[both, 3], yaw=np.interp(time, attitude[:, 0], yaw))
