"""An LSM9DS0 in counts and the thermometer of a barometer, as a satellite in a can tells them by radio.

Of each log stands a time in which it lies.
"""

import re
from pathlib import Path

import numpy as np

FIELDS = ("Time", "NTC", "Temp", "Press", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ")
LINE = re.compile(">" + r"\|".join(rf"{name}:(-?[\d.]+)" for name in FIELDS) + r"\|")
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,temp"
for name, log, first, last in (("still", "1435039927", 6300, 7240), ("cools", "1435044697", 10212, 10362)):
    told = Path(f"raw/cansat_{log}.log").read_text(encoding="latin-1")
    held = np.array([[float(x) for x in row] for row in LINE.findall(told)])
    time = held[:, 0] / 1000
    table = np.column_stack([time - first, held[:, 4:], held[:, 2]])[(time > first) & (time < last)]
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
