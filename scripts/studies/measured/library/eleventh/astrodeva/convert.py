"""A logger's lines as tables: seconds, accelerations in g, temperature. The time stands in the log's own prefix."""

import csv
import re
from datetime import datetime
from pathlib import Path

import numpy as np

for name, log in {"desk": "data01_test", "station": "data01"}.items():
    rows = []
    with Path(f"raw/{log}.csv").open(encoding="utf-8") as lines:
        for line in csv.reader(lines):
            stamp = re.match(r"\[I (\d{6} \d\d:\d\d:\d\d)", line[0])
            if stamp:
                time = datetime.strptime(stamp.group(1), "%y%m%d %H:%M:%S").timestamp()
                rows.append([time, *map(float, line[7:10]), float(line[14])])
    table = np.array(rows)
    table[:, 0] -= table[0, 0]
    np.savetxt(f"{name}.csv", table, fmt="%.9g", delimiter=",", header="t,ax,ay,az,temperature", comments="")
