"""A small quadrotor that hovers: yaw from cameras, as the craft was sent it, at the rows of its gyro.

From 2 s on, where it takes off, to 14.5 s; then it comes down.
"""

import json
from pathlib import Path

import numpy as np

(file,) = Path("raw").rglob("hover_01.json")
log = json.loads(file.read_text())["drone"]
gyro, yaw = log["ae483log.w_z"], log["ae483log.psi_mocap"]
time = np.array(gyro["time"])
at = (time > time[0] + 2.0) & (time < time[0] + 14.5)
angle = np.interp(time[at], yaw["time"], np.unwrap(yaw["data"]))
table = np.column_stack([time[at] - time[0], angle, np.array(gyro["data"])[at]])
np.savetxt("hover.csv", table, delimiter=",", header="time_s,yaw_rad,gyro_z_rad_s", comments="", fmt="%.9g")
