"""A model helicopter that hovers: the turn of its body from the cameras, at the rows of the gyro.

It flies from 2 to 36 s and the cameras lose it at 9.5 s: 11 to 36 s are taken. The stamps of the cameras' header are
used, those of the gyro are of its message. And a quadrotor beside the course it was to fly: its yaw rate follows.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

STEP, REACH = 0.005, 4
HERE = Path("raw/FlightTesting/FlightTest/Hover")


def body_rates(time, quaternions):
    """Times and rates about the body's axes, over 40 ms; quaternions are (w, x, y, z)."""
    signs = np.cumprod(np.r_[1.0, np.where((quaternions[1:] * quaternions[:-1]).sum(1) < 0, -1.0, 1.0)])
    even = np.arange(time[0], time[-1], STEP)
    q = np.column_stack([np.interp(even, time, column) for column in (quaternions * signs[:, None]).T])
    q /= np.linalg.norm(q, axis=1)[:, None]
    a, b = q[: -2 * REACH], q[2 * REACH :]
    w = (a * b).sum(1)
    v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    turned = 2 * np.arctan2(np.linalg.norm(v, axis=1), np.abs(w)) * np.sign(w)
    return even[REACH:-REACH], v / (np.linalg.norm(v, axis=1) + 1e-15)[:, None] * (turned / (2 * REACH * STEP))[:, None]


imu = np.genfromtxt(HERE / "hover_imu.csv", delimiter=",", skip_header=1)
vicon = np.genfromtxt(HERE / "hover_vicon.csv", delimiter=",", skip_header=1)
first = imu[0, 0]
stamps = (vicon[:, 2] - first) / 1e9
kept = np.r_[True, np.diff(stamps) > 0]
time, rates = body_rates(stamps[kept], vicon[kept][:, [11, 8, 9, 10]])
at = (imu[:, 0] - first) / 1e9
rows = (at > 11.0) & (at < 36.0)
table = np.column_stack([at[rows], *(np.interp(at[rows], time, rate) for rate in rates.T), imu[rows, 4:7]])
head = "time_s,vicon_x,vicon_y,vicon_z,gyro_x_dps,gyro_y_dps,gyro_z_dps"
np.savetxt("hover.csv", table, delimiter=",", header=head, comments="", fmt="%.8g")

gyro = loadmat("raw/matlab_code/EKF/mit_imu.mat")["mitimuquad1"]
pose = loadmat("raw/matlab_code/EKF/mit_vicon.mat")["mitviconquad"]
at, stamps = (gyro[:, 0] - gyro[0, 0]) / 1e9, (pose[:, 2] - gyro[0, 0]) / 1e9
yaw = np.unwrap(2 * np.arctan2(pose[:, 9], pose[:, 10]))
course = np.interp(at, stamps, np.gradient(yaw, stamps))
table = np.column_stack([at, course, gyro[:, 3]])
np.savetxt("course.csv", table, delimiter=",", header="time_s,course_yaw_rate,gyro_z", comments="", fmt="%.8g")
