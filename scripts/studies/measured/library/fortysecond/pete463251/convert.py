"""A BNO055 of a rocket: its wait in two attitudes, and its gyro z beside its own heading as it is carried about level.

The clock of the computer is set once by 86 s; the rows behind it stand for themselves. Gyros and accelerometers are as
they were written.
"""

from pathlib import Path

import numpy as np

lines = Path("raw/IMU.txt").read_text().splitlines()
held = np.array([[float(x) for x in line.split(",")] for line in lines if line.count(",") == 23])
time = held[:, 23] / 1000
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z,temp"
for name, first, last in (("waits", 0, 600), ("lies", 980, 1480)):
    table = np.column_stack([time[first:last] - time[first], held[first:last][:, [11, 12, 13, 14, 15, 16, 7]]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
level = slice(2600, 3260)
heading = -np.degrees(np.unwrap(np.radians(held[level, 0])))
table = np.column_stack([time[level] - time[level][0], heading, held[level, 13]])
np.savetxt("flies.csv", table, delimiter=",", header="time_s,heading_deg,gyro", comments="", fmt="%.9g")
