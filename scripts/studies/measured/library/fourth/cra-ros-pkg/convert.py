"""The gyro of a robot's upright axis beside the heading of its wheel odometry, both out of a bag."""

import struct

import numpy as np
from ros_bag import imu, messages


def heading(file, topic):
    """Times and headings [rad] of odometry: the frame's name stands before position and quaternion."""
    for stamp, body in messages(file, topic):
        (n,) = struct.unpack_from("<I", body)
        *_, z, w = struct.unpack_from("<7d", body, 4 + n)
        yield stamp, 2.0 * np.arctan2(z, w)


BAG = "raw/test/test1.bag"
time, _, rate = imu(BAG, "/imu/data")
wheels = np.array(list(heading(BAG, "/husky_velocity_controller/odom")))
angle = np.interp(time, wheels[:, 0], np.unwrap(wheels[:, 1]))
both = (time >= wheels[0, 0]) & (time <= wheels[-1, 0])
np.savetxt(
    "husky.csv",
    np.column_stack((time - time[0], rate[:, 1], angle))[both],
    delimiter=",",
    header="time,gyro,heading",
    comments="",
    fmt="%.12g",
)
