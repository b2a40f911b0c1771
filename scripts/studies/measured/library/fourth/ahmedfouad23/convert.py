"""Gyros on a robot's flange beside what the robot's attitude turned about the sensor's axes.

The owner interpolated the robot's quaternions to the sensor's rows, through nothing where their sign changed: there the
turned angle is interpolated instead.
"""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

log = loadmat("raw/ALI/ev50ps3/MPU6050RM3100.mat", variable_names=["MATLABtime", "SENSgyro", "ABBquaternion"])
time, gyro, quaternion = log["MATLABtime"][0, 1:], log["SENSgyro"][:, 1:], log["ABBquaternion"][:, 1:]
good = np.linalg.norm(quaternion, axis=0) > 0.99
attitude = Rotation.from_quat(quaternion[[1, 2, 3, 0]][:, good].T).inv()
turned = np.cumsum((attitude[:-1].inv() * attitude[1:]).as_rotvec(), axis=0)
angles = [np.interp(time, time[good], np.concatenate(([0.0], turned[:, axis]))) for axis in (0, 2)]
np.savetxt(
    "robot.csv",
    np.column_stack((time, gyro[0], gyro[2], *angles)),
    delimiter=",",
    header="time,gyro_x,gyro_z,angle_x,angle_z",
    comments="",
    fmt="%.12g",
)
