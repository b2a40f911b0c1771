"""A Sense HAT at rest: seconds from the first row, what its unit and its thermometer read."""

import csv
from datetime import datetime
from io import StringIO
from pathlib import Path

names = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z", "temp_h"]
rows = list(csv.DictReader(StringIO(Path("raw/data/still.csv").read_text())))
start = datetime.fromisoformat(rows[0]["timestamp"])
lines = ["time_s," + ",".join(names)]
for row in rows:
    seconds = (datetime.fromisoformat(row["timestamp"]) - start).total_seconds()
    lines.append(f"{seconds:.6f}," + ",".join(row[name] for name in names))
Path("still.csv").write_text("\n".join(lines) + "\n")
