"""A robot that drives squares of a metre: gyro z and the heading that its wheels have summed up."""

from io import StringIO
from pathlib import Path

import numpy as np

NAMES = ("crude_1m_square", "crude_1m_squareV3")
TIME, GYRO_Z, YAW_STEP = 0, 6, 18

for name in NAMES:
    text = Path("raw/extras/data/fusion", f"{name}.csv").read_text(encoding="utf-8")
    rows = np.genfromtxt(StringIO(text), delimiter=",", skip_header=1)
    table = np.column_stack([rows[:, TIME], rows[:, GYRO_Z], np.cumsum(rows[:, YAW_STEP])])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,gyro_z,wheel_heading", comments="", fmt="%.8g")
