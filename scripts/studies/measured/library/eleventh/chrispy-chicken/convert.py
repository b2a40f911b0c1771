"""A unit's rates beside the angles that its own attitude turned about its own axes.

In the bag the quaternion stands in the order w, x, y, z in fields of the order x, y, z, w; in the text too. The text's
rows are accelerations, rates and quaternion without times.
"""

import struct

import numpy as np
from ros_bag import messages
from scipy.spatial.transform import Rotation


def turned(quaternions):
    attitude = Rotation.from_quat(quaternions)
    steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))


def write(name, rates, angles, time=None):
    columns, names = [rates, angles], ["gx", "gy", "gz", "angle_x", "angle_y", "angle_z"]
    if time is not None:
        columns, names = [time[:, None], *columns], ["t", *names]
    np.savetxt(f"{name}.csv", np.hstack(columns), fmt="%.9f", delimiter=",", header=",".join(names), comments="")


bag = np.array([(stamp, *struct.unpack_from("<37d", body)) for stamp, body in messages("raw/imu.bag", "/imu")])
write("bag", bag[:, 14:17], turned(bag[:, [2, 3, 4, 1]]), bag[:, 0] - bag[0, 0])
text = np.loadtxt("raw/imu.txt")
write("text", text[:, 3:6], turned(text[:, [7, 8, 9, 6]]))
