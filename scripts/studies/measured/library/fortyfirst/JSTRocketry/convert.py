"""The computer of a rocket as it waits: its accelerometer in hundredths of g, and the angles that it sums of its gyros.

Of each of two flights stands the longest stretch in which nothing is touched.
"""

import re
from pathlib import Path

import numpy as np

NUMBER = r"(-?[\d.]+)"
for name, log, first, last in (("wait1", 1, 166.5, 194.0), ("wait2", 2, 143.0, 173.0)):
    text = Path(f"raw/HART_LAUNCH_{log}.TXT").read_text(errors="replace")
    found = {}
    for key in "OA":
        pattern = rf"@\{{{key}X:{NUMBER};{key}Y:{NUMBER};{key}Z:{NUMBER};TS:(\d+);\}}@"
        found[key] = np.array([[float(x) for x in row] for row in re.findall(pattern, text)])
    acc = found["A"]
    keep = (acc[:, 3] >= first * 1000) & (acc[:, 3] < last * 1000)
    table = np.column_stack([acc[keep, 3] / 1000, acc[keep, :3]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
