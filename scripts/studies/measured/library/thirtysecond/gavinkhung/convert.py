"""Left wheel of a robot that a slowly rising voltage drives backwards.

Distance and speed of a wheel in m and m/s, in angle and rate by the length of a turn that the file gives.
"""

import json
from pathlib import Path

import numpy as np

log = json.loads(Path("raw/characterization-data20210503-1848.json").read_text(encoding="utf-8"))
turn = float(log["unitsPerRotation"])
for phase, side, name in [("slow-backward", "left", "back")]:
    rows = np.array(log[phase], dtype=float)
    column = {"left": 5, "right": 6}[side]
    wheel = rows[:, [column, column + 2]] * 2 * np.pi / turn
    table = np.column_stack([rows[:, 0], wheel])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle,rate", comments="", fmt="%.9g")
