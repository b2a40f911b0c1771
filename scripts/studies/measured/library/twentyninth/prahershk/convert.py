"""A small quadrotor that hovers under its own filter: the roll that it estimates, at the rows of its gyro.

From take-off to 14.5 s; then it comes down.
"""

import json
from pathlib import Path

import numpy as np

(file,) = Path("raw").rglob("cc_do_hover.json")
log = json.loads(file.read_text())
gyro, roll = log["ae483log.w_x"], log["stateEstimate.roll"]
time = np.array(gyro["time"]) / 1000
seen = np.array(roll["time"]) / 1000
at = (time > time[0] + 0.3) & (time < time[0] + 14.5)
table = np.column_stack([time[at] - time[0], np.interp(time[at], seen, roll["data"]), np.array(gyro["data"])[at]])
np.savetxt("hover.csv", table, delimiter=",", header="time_s,roll_deg,gyro_x_rad_s", comments="", fmt="%.9g")
