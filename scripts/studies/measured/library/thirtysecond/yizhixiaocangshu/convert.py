"""Motors of an arm in the part of a test in which they are told a speed.

A position is sent within 12.5 rad of nought and starts anew beyond: it goes on here.
"""

import numpy as np

for motor in ("02", "03"):
    capture = np.load(f"raw/results/runs/20260425_085915_identify-all/group_01/motor_{motor}/capture.npz")
    told = np.flatnonzero(capture["velocity_cmd"] != 0)
    rows = slice(told[0], told[-1] + 1)
    position = capture["position"]
    step = (np.diff(position) + 12.5) % 25 - 12.5
    angle = position[0] + np.concatenate([[0], np.cumsum(step)])
    table = np.column_stack([capture["time"], angle, capture["velocity"], capture["velocity_cmd"]])[rows]
    head = "time_s,position,velocity,velocity_cmd"
    np.savetxt(f"motor_{motor}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
