"""A stretch of a minute and a half in which the unit is not moved."""

import csv

NAMES = ["Time (s)", "Accel X", "Accel Y", "Accel Z", "Gyro X", "Gyro Y", "Gyro Z"]
with open("raw/data/3-18-sheldon.csv", newline="") as file:
    rows = list(csv.DictReader(file))[8543:9387]
with open("stand.csv", "w", newline="") as file:
    write = csv.writer(file, lineterminator="\n")
    write.writerow(["time_s", "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z"])
    write.writerows([row[name] for name in NAMES] for row in rows)
