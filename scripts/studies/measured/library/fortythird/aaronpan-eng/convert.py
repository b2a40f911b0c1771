"""A VN-100 in a car that drives for 755 s, at 40 Hz, from lines of its own.

The axes point forward, right and down. The times of the computer lie 3 to 153 ms apart; the unit itself tells 40 rows
in a second, and these count here. The angles are summed up from its own yaw, pitch and roll.
"""

import csv
import io
import re
import zipfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

LINE = re.compile(r"\$VNYMR,([-+\d.,]+)\*")

with zipfile.ZipFile(Path("raw/lab5/src/data/data_driving.zip")) as held, held.open("data_driving/imu.csv") as file:
    told = [LINE.search(row[-1]) for row in csv.reader(io.TextIOWrapper(file, encoding="utf-8")) if row]
rows = np.array([list(map(float, line[1].split(","))) for line in told if line is not None])
attitude = Rotation.from_euler("ZYX", rows[:, :3], degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
time = np.arange(len(rows)) / 40.0
for name, axis in (("about_x", 0), ("about_z", 2)):
    table = np.column_stack([time, angles[:, axis], rows[:, 9 + axis]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
