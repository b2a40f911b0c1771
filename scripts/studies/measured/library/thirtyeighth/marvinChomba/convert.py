"""What a test program prints of an ICM-20948: at rest, and turned about in the hand with rests between.

Counts of 1/16384 of gravity and 1/32.8 deg/s, a reading a second as the program waits.
"""

import re
from pathlib import Path

import numpy as np

LINE = re.compile(r"(Acceleration|Gyroscope):\s*X = (-?\d+) , Y = (-?\d+) , Z = (-?\d+)")
for name, log in {"rest": "sensor1.txt", "turned": "sensor1.csv"}.items():
    found = LINE.findall((Path("raw") / log).read_text(encoding="utf-8", errors="replace"))
    rows = {
        kind: np.array([[int(x) for x in values] for what, *values in found if what == kind])
        for kind in ("Acceleration", "Gyroscope")
    }
    last = min(map(len, rows.values()))
    table = np.column_stack([np.arange(last), rows["Acceleration"][:last], rows["Gyroscope"][:last]])
    head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%d")
