"""Messages of channel IMU out of an LCM log: a car in circles, and at rest twice; the log's stamps are microseconds."""

import struct
from pathlib import Path

import numpy as np

log = Path("raw/my_robot/logfiles_gps_imu/circles/lcmlog-2017-02-18.00").read_bytes()
rows, at = [], 0
while at + 28 <= len(log):
    _, _, stamp, name, size = struct.unpack(">IqqII", log[at : at + 28])
    if log[at + 28 : at + 28 + name] == b"IMU":
        rows.append((stamp * 1e-6, *struct.unpack(">12d", log[at + 44 + name : at + 28 + name + size])))
    at += 28 + name + size
rows = np.array(rows)
rows[:, 0] -= rows[0, 0]
names = "t,yaw,pitch,roll,mx,my,mz,ax,ay,az,gx,gy,gz"
for part, start, end in (("circle", 0.0, 68.5), ("idle_first", 80.0, 172.0), ("idle_second", 690.0, 800.0)):
    kept = rows[(rows[:, 0] >= start) & (rows[:, 0] < end)]
    np.savetxt(f"{part}.csv", kept, fmt="%.9g", delimiter=",", header=names, comments="")
