"""A car's log in the order of its stamps, which are seconds of the minute.

Of a stamp the microseconds were written without the zeros before them (7.67901 is 7.067901 s). They are left as they
are, as the independent fit took them: about one row in six is late, by up to 0.9 s, and stands among later ones.
"""

import csv
from pathlib import Path

MINUTE = 60.0

with Path("raw/IMU.csv").open(encoding="utf-8") as file:
    rows = list(csv.DictReader(file))
times = [float(row["time"]) for row in rows]
minutes, passed = [0.0], 0.0
for before, now in zip(times, times[1:], strict=False):
    passed += MINUTE if now < before - MINUTE / 2.0 else 0.0
    minutes.append(passed)
table = sorted((t + m, row["yaw"], row["heading"]) for t, m, row in zip(times, minutes, rows, strict=True))
lines = [f"{time:.6f},{yaw},{heading}" for time, yaw, heading in table]
Path("car.csv").write_text("\n".join(("time,yaw,heading", *lines)) + "\n", encoding="utf-8")
