"""The rows in which a CanSat stands before its start; the log has decimal commas, and cells that are empty."""

import csv
from pathlib import Path

BEGIN, DURATION = 3298.0, 1320.0  # [s]: it is handled before, and moved after

columns = "Timestamp", "Absolute Acceleration Z (m/s^2)", "Temperature (°C)"
rows = ["time,accel_z,temperature"]
with Path("raw/datalog.csv").open(encoding="utf-8") as file:
    for row in csv.DictReader(file, delimiter=";"):
        cells = [row[name].replace(",", ".") for name in columns]
        time = float(cells[0]) * 1e-3
        if BEGIN <= time < BEGIN + DURATION and all(cells):
            rows.append(f"{time:.3f},{cells[1]},{cells[2]}")
Path("stand.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
