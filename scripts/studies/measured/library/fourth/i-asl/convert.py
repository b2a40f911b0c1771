"""A drone's gyros beside what the motion capture's attitude turned about their axes.

The clocks are set to each other to a tenth of a second; the optical body's axes are those of the gyros turned by right
angles. Rows in which the optical system saw nothing are zeros.
"""

import numpy as np
from ros_bag import imu
from scipy.spatial.transform import Rotation
from turned import body_angles

# of each flight: the bag's first row on the optical clock [s]; of the gyro that is wanted: its axis, the optical one
FLIGHTS = {1: (1.3, "z", "-z"), 2: (-0.7, "x", "x"), 3: (0.9, "z", "-z")}


def turned(attitude):
    return body_angles(attitude)


for flight, (begin, axis, optical) in FLIGHTS.items():
    time, _, rate = imu(f"raw/rosbag/0612_hw{flight}.bag", "/imu/data")
    time += begin - time[0]
    truth = np.loadtxt(f"raw/scenario{flight}/gt.csv", skiprows=1)
    truth = truth[np.abs(truth[:, 4:]).sum(axis=1) > 0.0]
    attitude = Rotation.from_matrix(truth[:, 4:].reshape(-1, 3, 3).transpose(0, 2, 1))
    angle = turned(attitude)[:, "xyz".index(optical[-1])] * (-1.0 if optical[0] == "-" else 1.0)
    both = (time >= truth[0, 0]) & (time <= truth[-1, 0])
    np.savetxt(
        f"drone{flight}.csv",
        np.column_stack((time, rate[:, "xyz".index(axis)], np.interp(time, truth[:, 0], angle)))[both],
        delimiter=",",
        header=f"time,gyro_{axis},angle_{axis}",
        comments="",
        fmt="%.12g",
    )
