"""A delivery robot: gyro about z summed between the rows of its wheels' encoders, ten a second.

Wheels of 0.155 m, 1024 counts a turn, 0.78 m apart: a count more of the right wheel in 0.1 s turns by 0.012193 rad/s.
"""

from pathlib import Path

import numpy as np

imu, odometer = [], []
for line in (Path("raw/fusion4_improve/data") / "10_small_sad.txt").read_text(encoding="utf-8").splitlines():
    kind, *cells = line.split()
    if kind == "IMU":
        imu.append([float(x) for x in cells[:4]])
    elif kind == "ODOM":
        odometer.append([float(x) for x in cells[:3]])
rates, counts = np.array(imu), np.array(odometer)
angle = np.concatenate(([0.0], np.cumsum(rates[1:, 3] * np.diff(rates[:, 0]))))
turned = np.diff(np.interp(counts[:, 0], rates[:, 0], angle))
table = np.column_stack((counts[1:, 0] - counts[0, 0], turned, counts[1:, 2] - counts[1:, 1]))
np.savetxt("robot.csv", table, delimiter=",", header="time,gyro_rad,counts_apart", comments="", fmt="%.10g")
