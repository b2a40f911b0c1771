"""Messages IMU and IMU2 of an autopilot's text log behind its gap: two gyros [rad/s]."""

from pathlib import Path

import numpy as np

text = next(Path("raw").rglob("nan.log")).read_text(encoding="utf-8", errors="replace").splitlines()
one, two = (
    np.array([[float(cell) for cell in line.split(",")[1:5]] for line in text if line.startswith(f"{name},")])
    for name in ("IMU", "IMU2")
)
start = int(np.argmax(np.diff(one[:, 0]))) + 1
table = np.column_stack([1e-3 * (one[start:, 0] - one[start, 0]), one[start:, 1:], two[start:, 1:]])
header = "time,gyro_x,gyro_y,gyro_z,gyro2_x,gyro2_y,gyro2_z"
np.savetxt("flown.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
