"""Gyros of a board, the date of each row as seconds from the first."""

import csv
from datetime import datetime
from io import StringIO
from pathlib import Path

rows = list(csv.DictReader(StringIO(Path("raw/W5/gyro_data_final.csv").read_text())))
start = datetime.fromisoformat(rows[0]["ts"])
lines = [f"{(datetime.fromisoformat(r['ts']) - start).total_seconds():.3f},{r['gx']},{r['gy']},{r['gz']}" for r in rows]
Path("desk.csv").write_text("time_s,gx,gy,gz\n" + "\n".join(lines) + "\n")
