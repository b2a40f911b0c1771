"""LSM6DSO on an evaluation board: tables with units in their heads, no times."""

from pathlib import Path

import numpy as np

for name in ("static", "linear"):
    lines = (Path("raw") / f"{name}.txt").read_text(encoding="utf-8", errors="replace").splitlines()
    cells = [line.split() for line in lines]
    rows = np.array([[float(x) for x in row[:9]] for row in cells if len(row) > 8 and row[0].lstrip("-").isdigit()])
    header = "ax_mg,ay_mg,az_mg,gx_dps,gy_dps,gz_dps"
    np.savetxt(f"{name}.csv", rows[:, [0, 1, 2, 6, 7, 8]], delimiter=",", header=header, comments="", fmt="%.9g")
