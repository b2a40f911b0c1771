"""The rows of the accelerometer alone, of a log that has those of a receiver too; time in seconds."""

import csv

for name in ("static1", "static2"):
    with open(f"raw/{name}.csv", newline="") as file:
        rows = [row for row in csv.reader(file) if row[0] == "IMU"]
    with open(f"{name}.csv", "w", newline="") as file:
        write = csv.writer(file, lineterminator="\n")
        write.writerow(["time_s", "accel"])
        write.writerows((f"{int(row[1]) / 1e3:.3f}", row[2]) for row in rows)
