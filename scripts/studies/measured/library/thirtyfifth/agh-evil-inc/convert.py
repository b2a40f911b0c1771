"""A sensor board on its faces and at rest: names without units in brackets, times in seconds.

Of the log at rest the first 14.6 s are taken, after which the board is turned about.
"""

import csv
from pathlib import Path

RAW = Path("raw/data")
#: Table, log and span of its times [s]
LOGS = (
    ("board", "plytka_ACC_Data_Log_2024_10_16_13_20_44", (-1.0, 1e9)),
    ("board_rest", "plytka_GYRO_Data_Log_2024_10_16_14_15_32", (0.4, 15.0)),
)

for table, log, (first, last) in LOGS:
    rows = list(csv.reader((RAW / f"{log}.csv").read_text(encoding="utf-8").splitlines()))[1:]
    with Path(f"{table}.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(["t", "ax", "ay", "az", "gx", "gy", "gz"])
        for time, *values in rows:
            if first < float(time) * 1e-6 < last:
                out.writerow([f"{float(time) * 1e-6:.6f}", *values[:6]])
