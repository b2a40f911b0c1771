"""A lever that balances: times in s, its encoder in degrees, with the sign of its gyro, and the gyro in deg/s."""

import csv
from pathlib import Path

FILES = {"first": "2026-06-07_13-48-31", "last": "2026-06-28_19-41-56"}
for name, day in FILES.items():
    rows = list(csv.DictReader(next(Path("raw").rglob(f"{day}/log.csv")).open(encoding="utf-8")))
    start = int(rows[0]["T_MS"])
    with Path(f"{name}.csv").open("w", encoding="utf-8") as out:
        out.write("time,gyro_x,angle\n")
        for row in rows:
            out.write(f"{(int(row['T_MS']) - start) / 1000},{row['GYRO_X']},{-float(row['ENC_ROLL']):g}\n")
