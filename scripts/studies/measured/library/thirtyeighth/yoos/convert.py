"""Logs of a KVH 1750, a fibre-optic unit: its rests before it is turned, and one log with the half turns.

A line holds what a sample adds to the angle, in degrees, whatever its head says: the column behind sums it. Times are
not told; the unit sends 1000 samples a second (500 through the other board).
"""

import re
from pathlib import Path

import numpy as np

NUMBER = re.compile(r"-?\d+\.\d+")
RESTS = {"kvh_direct_imu_rate": 1700, "kvh_direct_imu_delta": 2300, "kvh_medulla_ext_rate": 900}
for log, last in RESTS.items():
    lines = (Path("raw") / f"{log}.log").read_text(encoding="utf-8").splitlines()[1:]
    steps = np.array([[float(x) for x in NUMBER.findall(line)[:3]] for line in lines])
    time = (np.arange(len(steps)) + 1) * (0.002 if "medulla" in log else 0.001)
    table = np.column_stack([time, steps])
    head = "time_s,step_x_deg,step_y_deg,step_z_deg"
    name = log.removeprefix("kvh_")
    np.savetxt(f"{name}_rest.csv", table[:last], delimiter=",", header=head, comments="", fmt="%.9g")
    if name == "direct_imu_rate":
        np.savetxt("half_turns.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
