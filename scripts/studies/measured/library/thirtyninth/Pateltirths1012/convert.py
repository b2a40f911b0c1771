"""A VN-100 in a car, 20 readings a second: the rest before it starts, and the heading it tells while it drives circles.

The heading is read out of the unit's own sentence ($VNYMR), in degrees, and unwrapped; times are those of the stamps.
"""

import csv
from pathlib import Path

import numpy as np

with Path("raw/lab5/src/data/data_going_in_circles/imu.csv").open(encoding="utf-8") as read:
    rows = list(csv.DictReader(read))
time = np.array([int(r["header.stamp.secs"]) + 1e-9 * int(r["header.stamp.nsecs"]) for r in rows])
said = np.array([r["imu_read"].partition("*")[0].split(",")[1:] for r in rows], float)
heading = np.degrees(np.unwrap(np.radians(said[:, 0])))
table = np.column_stack([time - time[0], heading, said[:, 9:12], said[:, 6:9]])
head = "time_s,heading_deg,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
np.savetxt("circles.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
np.savetxt("rest.csv", table[20:290], delimiter=",", header=head, comments="", fmt="%.9g")
