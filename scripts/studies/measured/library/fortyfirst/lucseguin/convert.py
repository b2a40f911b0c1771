"""An MPU-6050 moved from left to right: its gyro z in whole deg/s beside the rate of its own quaternion, at 10 Hz."""

import re
from pathlib import Path

import numpy as np

text = Path("raw/DATA_leftright_70secs_10hz.TXT").read_text()


def column(name: str) -> np.ndarray:
    return np.array([[float(x) for x in row.split(",")] for row in re.findall(rf"^{name}:(.*)$", text, re.MULTILINE)])


time, q, gyro = column("TotalTime")[:, 0], column("q"), column("gyro")
q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
(w, x, y, z), (dw, dx, dy, dz) = q.T, np.gradient(q, time, axis=0).T
rate = np.degrees(2 * (w * dz - x * dy + y * dx - z * dw))
table = np.column_stack([time, rate, gyro[:, 2]])[3:]
np.savetxt("moved.csv", table, delimiter=",", header="time_s,rate_z,gyro_z", comments="", fmt="%.9g")
