"""Means of the worn accelerometers over what lies still.

Still is a run of at least five readings (15 s apart, gaps below 180 s) within 0.1 m/s^2 of its first.
"""

from datetime import datetime
from pathlib import Path

import numpy as np

rows = [line.split(",") for line in Path("raw/accdata.csv").read_text(encoding="utf-8").split()[1:]]
times = np.array([datetime.strptime(r[0] + " " + r[1], "%d/%m/%Y %H:%M:%S").timestamp() for r in rows])
values = np.array([[float(v) for v in r[2:5]] for r in rows])
means = []
first = 0
while first < len(values):
    end = first + 1
    while end < len(values) and times[end] - times[end - 1] < 180 and np.abs(values[end] - values[first]).max() < 0.1:
        end += 1
    if end - first >= 5:
        means.append(values[first:end].mean(axis=0))
    first = end
np.savetxt("attitudes.csv", means, delimiter=",", header="x,y,z", comments="", fmt="%.6f")
