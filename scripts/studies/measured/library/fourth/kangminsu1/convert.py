"""A car's log with its stamps mended: seconds of the minute, then microseconds without the zeros before them.

"7.67901" is 7.067901 s, "0.53514" may be 0.535140 s: of the two that is taken which lies nearer to a step after the
last.
"""

import csv
from pathlib import Path

STEP = 0.25  # [s] between rows

rows, last, minute = [], None, 0.0
with Path("raw/IMU.csv").open(encoding="utf-8") as file:
    for row in csv.DictReader(file):
        seconds, _, fraction = row["time"].partition(".")
        choices = [int(seconds) + float(f"0.{fraction}"), int(seconds) + int(fraction) * 1e-6]
        if last is not None and int(seconds) + minute < last - 30.0:
            minute += 60.0
        wanted = choices[0] if last is None else last + STEP
        last = min((c + minute for c in choices), key=lambda time, wanted=wanted: abs(time - wanted))
        rows.append(f"{last:.6f},{row['yaw']},{row['heading']}")
Path("car.csv").write_text("\n".join(("time,yaw,heading", *rows)) + "\n", encoding="utf-8")
