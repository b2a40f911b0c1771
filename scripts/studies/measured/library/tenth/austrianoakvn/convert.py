"""A telephone's rate about the vertical beside the heading of its magnetometer, taken from the middle of its circle.

The vertical is the mean of the accelerations; the circle a least-squares one through the field across it. The
heading is read at the rates' times between its rows.
"""

from pathlib import Path

import numpy as np

raw = Path("raw/data/20-10-2020")
gyro, accel, field = (
    np.genfromtxt(raw / f"{name}.csv", delimiter=";", skip_header=1)
    for name in ("gyroscope", "accelerometer", "magnetometer")
)
up = accel[:, 1:].mean(axis=0)
up /= np.linalg.norm(up)
across = np.cross(up, (1.0, 0.0, 0.3))
across /= np.linalg.norm(across)
x, y = field[:, 1:] @ across, field[:, 1:] @ np.cross(up, across)
middle = np.linalg.lstsq(np.column_stack((x, y, np.ones(x.size))), x**2 + y**2, rcond=None)[0] / 2.0
heading = -np.unwrap(np.arctan2(y - middle[1], x - middle[0]))
heading *= np.sign(np.corrcoef(np.gradient(np.interp(gyro[:, 0], field[:, 0], heading)), gyro[:, 1:] @ up)[0, 1])
inside = (gyro[:, 0] >= field[0, 0]) & (gyro[:, 0] <= field[-1, 0])
gyro = gyro[inside]
np.savetxt(
    "walk.csv",
    np.column_stack((gyro[:, 0] - gyro[0, 0], gyro[:, 1:] @ up, np.interp(gyro[:, 0], field[:, 0], heading))),
    fmt="%.7f",
    delimiter=",",
    header="t,rate,heading",
    comments="",
)
