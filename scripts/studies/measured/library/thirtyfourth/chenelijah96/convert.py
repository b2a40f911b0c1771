"""A quadrotor before cameras: the rates of its body that they give, at the gyros' rows.

The cameras' axes x and y point against those of the gyros. The attitude's change from the row before to the row after,
40 ms. The log has a gap at 72 s: it is left there.
"""

from pathlib import Path

import numpy as np

log = np.genfromtxt(Path("raw/20190909-164734-Flying.csv"), delimiter=",", skip_header=1)
log = log[log[:, 0] < 72.0]
time, gyros = log[:, 0], log[:, 1:4]
yaw, pitch, roll = np.unwrap(log[:, 11]), log[:, 12], log[:, 13]
over = lambda angle: (angle[2:] - angle[:-2]) / (time[2:] - time[:-2])  # noqa: E731
yaws, pitches, rolls = over(yaw), over(pitch), over(roll)
p, r = pitch[1:-1], roll[1:-1]
body = np.column_stack([
    -(rolls - yaws * np.sin(p)),
    -(pitches * np.cos(r) + yaws * np.sin(r) * np.cos(p)),
    -pitches * np.sin(r) + yaws * np.cos(r) * np.cos(p),
])  # fmt: skip
table = np.column_stack([time[1:-1], gyros[1:-1], body])
head = "time_s,gyro_x,gyro_y,gyro_z,cameras_x,cameras_y,cameras_z"
np.savetxt("flying.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
