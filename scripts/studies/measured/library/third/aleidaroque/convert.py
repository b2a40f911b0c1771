"""Readings whose rows end with a semicolon as tables."""

from pathlib import Path

import numpy as np

NAMES = {"GYR_reading_10m": "gyro10min"}
NAMES |= {f"ACC_reading_{sign}{axis.upper()}": sign + axis for sign in ("pos", "neg") for axis in "xyz"}

for file, name in NAMES.items():
    (path,) = Path("raw").rglob(file)
    rows = [line.replace(";", "").split() for line in path.read_text(encoding="utf-8").splitlines()]
    table = np.array([row for row in rows if len(row) == 3], dtype=float)
    np.savetxt(f"{name}.csv", table, delimiter=",", header="x,y,z", comments="", fmt="%d")
