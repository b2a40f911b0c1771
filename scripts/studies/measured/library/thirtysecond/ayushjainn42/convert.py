"""The telephone on the table, from the fiftieth row until it is taken up; time in seconds."""

import csv
from datetime import datetime

with open("raw/8.3D Data capture/accelerometer_log.csv", newline="") as file:
    rows = list(csv.DictReader(file))[50:330]
start = datetime.strptime(rows[0]["time"], "%H:%M:%S")
with open("table.csv", "w", newline="") as file:
    write = csv.writer(file, lineterminator="\n")
    write.writerow(["time_s", "x", "y", "z"])
    for row in rows:
        seconds = (datetime.strptime(row["time"], "%H:%M:%S") - start).total_seconds()
        write.writerow([f"{seconds:.0f}", row["x"], row["y"], row["z"]])
