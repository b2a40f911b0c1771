"""A robot that drives through a hall: its gyro beside the heading of its own pose, and the gyro before it starts.

The clocks of the two logs stand 27083 s apart; the shift was found from the headings themselves (least is left where
the pose starts 0.84 s before the gyro), so what is left of a delay tells nothing. The gyro is positive the other way.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw")
SHIFT = 0.84  # s, by which the pose starts before the gyro

gyro = np.loadtxt(RAW / "gyro.txt")
pose = np.loadtxt(RAW / "wean_sensors/wean/wean_wide_interesting.localpose.log")
start = np.loadtxt(RAW / "encoder.txt", max_rows=1)[0]
time = gyro[:, 0] - gyro[0, 0]
there = pose[:, 0] - start - SHIFT
heading = -np.degrees(np.interp(time, there, np.unwrap(pose[:, 7])))
moved = (time > there[0]) & (time < there[-1])
table = np.column_stack([time, heading, gyro[:, 2], gyro[:, 1]])
head = "time_s,heading_deg,gyro_deg_s,temp_c"
np.savetxt("drive.csv", table[moved], delimiter=",", header=head, comments="", fmt="%.9g")
np.savetxt("rest.csv", table[:360], delimiter=",", header=head, comments="", fmt="%.9g")
