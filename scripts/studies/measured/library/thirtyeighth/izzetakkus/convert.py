"""A small quadcopter that is tilted by hand, its motors off: sensors at 200 Hz beside the attitude that it estimates.

The rates that the attitude tells are d(roll)/dt - d(yaw)/dt sin(pitch) about x, and
d(pitch)/dt cos(roll) + d(yaw)/dt sin(roll) cos(pitch) about y.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

held = loadmat(Path("raw/RSdata4.mat"), squeeze_me=True, struct_as_record=False)
time = held["rt_sensor"].time
sensors = np.atleast_1d(held["rt_sensor"].signals)[0].values
attitude = np.atleast_1d(held["rt_estim"].signals)[0].values[:, 3:6]
yaw, pitch, roll = np.unwrap(attitude, axis=0).T
dyaw, dpitch, droll = (np.gradient(angle, time) for angle in (yaw, pitch, roll))
about_x = droll - dyaw * np.sin(pitch)
about_y = dpitch * np.cos(roll) + dyaw * np.sin(roll) * np.cos(pitch)
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,rate_x,rate_y"
table = np.column_stack([time - time[0], sensors[:, :6], about_x, about_y])
np.savetxt("tilts.csv", table[20:5580], delimiter=",", header=head, comments="", fmt="%.9g")
np.savetxt("level.csv", table[:600], delimiter=",", header=head, comments="", fmt="%.9g")
