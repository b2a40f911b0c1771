"""A small quadrotor that flies: the yaw that its filter estimates, at the rows of its gyro.

From take-off to 21.5 s; then it comes down.
"""

import json
from pathlib import Path

import numpy as np

for flight, name in (("lab9_square_flight4", "square"), ("lab7_flight1", "first")):
    log = json.loads(Path(f"raw/{flight}.json").read_text())
    gyro, yaw = log["ae483log.w_z"], log["stateEstimate.yaw"]
    time, seen = np.array(gyro["time"]) / 1000, np.array(yaw["time"]) / 1000
    at = (time > time[0] + 0.3) & (time < time[0] + 21.5)
    angle = np.interp(time[at], seen, np.unwrap(yaw["data"], period=360))
    table = np.column_stack([time[at] - time[0], angle, np.array(gyro["data"])[at]])
    head = "time_s,yaw_deg,gyro_z_rad_s"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
