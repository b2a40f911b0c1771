"""A Shimmer on a door that swings, 17 s at about 200 Hz: gyros in deg/s and its wide-range accelerometer."""

import csv
from pathlib import Path

import numpy as np

with Path("raw/new_door_test.csv").open(encoding="utf-8-sig") as lines:
    rows = list(csv.reader(lines))
wanted = [rows[0].index(f"Shimmer_3B52_{kind}_{axis}_CAL") for kind in ("Gyro", "Accel_WR") for axis in "XYZ"]
table = np.array([[float(row[k]) for k in wanted] for row in rows[1:] if len(row) > max(wanted)])
time = np.arange(len(table)) / 204.8
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
np.savetxt("door.csv", np.column_stack([time, table]), delimiter=",", header=head, comments="", fmt="%.9g")
