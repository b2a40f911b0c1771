"""The first stretch of hourly rows of a chain of inclinometers in a borehole; sines of the angles, time in hours."""

import csv
from datetime import datetime

with open("raw/sample_data.dat", newline="") as file:
    rows = list(csv.reader(file))[1:]
head, rows = rows[0], rows[3:][4:84]
start = datetime.fromisoformat(rows[0][0])
wanted = ["PTemp", *(f"IPI_1_{kind}({k})" for k in (1, 2, 6) for kind in ("Tilt_A", "Tilt_B", "Therm"))]
with open("hourly.csv", "w", newline="") as file:
    write = csv.writer(file, lineterminator="\n")
    write.writerow(
        ["time_s", "logger_degC", *(f"{kind}_{k}" for k in (1, 2, 6) for kind in ("tilt_a", "tilt_b", "degC"))]
    )
    for row in rows:
        seconds = (datetime.fromisoformat(row[0]) - start).total_seconds()
        write.writerow([f"{seconds:.0f}", *(row[head.index(name)] for name in wanted)])
