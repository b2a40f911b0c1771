"""A unit on a robot that drives about: times of day, gyros beside its own heading."""

from pathlib import Path

import numpy as np

rows = []
for line in Path("raw/imu.txt").read_text(encoding="utf-8", errors="replace").splitlines()[2:]:
    cells = line.split("\t")
    if len(cells) > 11:
        hours, minutes, seconds = (float(x) for x in cells[1].split(":"))
        rows.append([3600 * hours + 60 * minutes + seconds, *(float(x) for x in cells[2:12])])
table = np.array(rows)
table[:, 0] -= table[0, 0]
table[:, 9] = np.unwrap(table[:, 9], period=360.0)
header = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,roll,pitch,yaw,temperature"
np.savetxt("robot.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
