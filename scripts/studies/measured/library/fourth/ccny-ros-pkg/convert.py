"""Gyros out of two bags; of the AR.Drone with what the attitude of its firmware turned about y."""

import numpy as np
from ros_bag import imu
from scipy.spatial.transform import Rotation


def write(file, names, *columns):
    np.savetxt(file, np.column_stack(columns), delimiter=",", header=names, comments="", fmt="%.12g")


FOLDER = "raw/imu_filter_madgwick/sample"
time, quaternion, rate = imu(f"{FOLDER}/ardrone_imu.bag", "/ardrone/imu")
attitude = Rotation.from_quat(quaternion)
angle = np.concatenate(([0.0], np.cumsum((attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 1])))
write("ardrone.csv", "time,gyro_y,angle_y", time - time[0], rate[:, 1], angle)
time, _, rate = imu(f"{FOLDER}/phidgets_imu_upside_down.bag", "/imu/data_raw")
write("phidgets.csv", "time,gyro_x,gyro_y,gyro_z", time - time[0], rate)
