"""A unit whose rows come over ROS, at rest, and with z up and down.

Messages are sensor_msgs/Imu: a quaternion, rates and accelerations, each with nine covariances.
"""

import struct

import numpy as np
from ros_bag import messages

NAMES = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"


def read(bag: str) -> np.ndarray:
    rows = [(stamp, *struct.unpack_from("<37d", body)) for stamp, body in messages(f"raw/{bag}.bag", "/sensor/Imu")]
    held = np.array(rows)
    return np.column_stack([held[:, 0] - held[0, 0], held[:, 14:17], held[:, 26:29]])


for name, bag in {"rest": "original_static"}.items():
    np.savetxt(f"{name}.csv", read(bag), delimiter=",", header=NAMES, comments="", fmt="%.9g")
up, down = read("up_z"), read("down_z")
faces = np.r_[np.zeros(len(up)), np.ones(len(down))]
table = np.column_stack([np.arange(len(faces)) / 14, faces, np.vstack([up[:, 4:], down[:, 4:]])])
np.savetxt("two.csv", table, delimiter=",", header="time_s,face,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
