"""A wheel on a spring, with decimal points; rows without a rate (first and last) are left out."""

from pathlib import Path

import numpy as np

lines = Path("raw/Resonanz/1.1.csv").read_text(encoding="utf-8-sig").splitlines()[1:]
cells = [line.replace(",", ".").split(";") for line in lines]
table = np.array([[float(row[k]) for k in (0, 3, 4)] for row in cells if len(row) > 4 and row[4].strip()])
np.savetxt("wheel.csv", table, delimiter=",", header="time_s,angle,rate", comments="", fmt="%.9g")
