"""A quadrotor that flies before cameras: the turn of its body from their angles, at the rows of its gyros.

The angles are yaw, pitch and roll of a body whose x points forward and z down; the unit's x and y point the other way
(hand-held, they read the opposite sign), so that the cameras' are turned round.
"""

from pathlib import Path

import numpy as np

STEP, REACH = 0.01, 3
(file,) = (p for p in Path("raw").glob("*Flying.csv"))
rows = np.genfromtxt(file, delimiter=",", skip_header=1)
time = rows[:, 0]
even = np.arange(time[0], time[-1], STEP)
yaw, pitch, roll = (np.interp(even, time, np.unwrap(rows[:, k])) for k in (11, 12, 13))
middle = even[REACH:-REACH]


def rate(angle):
    """Rate of an angle over 60 ms."""
    return (angle[2 * REACH :] - angle[: -2 * REACH]) / (2 * REACH * STEP)


y, p, r = rate(yaw), rate(pitch), rate(roll)
roll, pitch = roll[REACH:-REACH], pitch[REACH:-REACH]
body = np.array(
    [
        r - y * np.sin(pitch),
        p * np.cos(roll) + y * np.sin(roll) * np.cos(pitch),
        y * np.cos(roll) * np.cos(pitch) - p * np.sin(roll),
    ]
)
at = (time > middle[0]) & (time < middle[-1])
cameras = [sign * np.interp(time[at], middle, w) for sign, w in zip((-1, -1, 1), body, strict=True)]
table = np.column_stack([time[at], *cameras, rows[at, 1:4]])
head = "time_s,cameras_x,cameras_y,cameras_z,gyro_x,gyro_y,gyro_z"
np.savetxt("flying.csv", table, delimiter=",", header=head, comments="", fmt="%.8g")
