"""A unit with a motor: its rows before the motor turns, and those while it turns; times in s."""

import csv
from datetime import datetime
from pathlib import Path

rows = list(csv.DictReader(next(Path("raw/data").glob("*_040618.csv")).open(encoding="utf-8")))
on = [row["motor_state"] == "1" for row in rows]
first, last = on.index(True), len(on) - on[::-1].index(True)
start = datetime.fromisoformat(rows[0]["timestamp"])
names = [name for name in rows[0] if name not in ("timestamp", "motor_state")]
for name, part in (("still", rows[:first]), ("running", rows[first:last])):
    with Path(f"{name}.csv").open("w", encoding="utf-8") as out:
        out.write(",".join(["time", *names]) + "\n")
        for row in part:
            time = (datetime.fromisoformat(row["timestamp"]) - start).total_seconds()
            out.write(",".join([f"{time:.6f}", *(f"{float(row[each]):.9g}" for each in names)]) + "\n")
