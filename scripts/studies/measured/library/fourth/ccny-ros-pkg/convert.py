"""Gyros out of two bags; of the AR.Drone with what the attitude of its firmware turned about y."""

import struct
from pathlib import Path

import numpy as np
from ros_bag import CONNECTION, MESSAGE, records
from scipy.spatial.transform import Rotation


def messages(file, topic):
    """Stamps of a topic's messages, and what follows their headers."""
    topics = {}
    for fields, body in records(Path(file)):
        if fields[b"op"] == CONNECTION:
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == MESSAGE and topics[fields[b"conn"]] == topic:
            _, seconds, nanoseconds, n = struct.unpack_from("<IIII", body)
            yield seconds + nanoseconds * 1e-9, body[16 + n :]


def imu(file, topic):
    """Times, quaternions (x, y, z, w) and rates [rad/s] of an inertial unit's messages."""
    rows = np.array([(stamp, *struct.unpack_from("<16d", body)) for stamp, body in messages(file, topic)])
    return rows[:, 0], rows[:, 1:5], rows[:, 14:17]


def write(file, names, *columns):
    np.savetxt(file, np.column_stack(columns), delimiter=",", header=names, comments="", fmt="%.12g")


FOLDER = "raw/imu_filter_madgwick/sample"
time, quaternion, rate = imu(f"{FOLDER}/ardrone_imu.bag", b"/ardrone/imu")
attitude = Rotation.from_quat(quaternion)
angle = np.concatenate(([0.0], np.cumsum((attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 1])))
write("ardrone.csv", "time,gyro_y,angle_y", time - time[0], rate[:, 1], angle)
time, _, rate = imu(f"{FOLDER}/phidgets_imu_upside_down.bag", b"/imu/data_raw")
write("phidgets.csv", "time,gyro_x,gyro_y,gyro_z", time - time[0], rate)
