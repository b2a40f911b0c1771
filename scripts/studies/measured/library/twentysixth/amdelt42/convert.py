"""Packets of a cart with a reaction wheel: its gyro [rad/s] in the longest time that nobody touches the cart."""

from pathlib import Path

import numpy as np

FIRST, LAST = 427.5, 431.4
rows = np.loadtxt(next(Path("raw").glob("telemetry_*.csv")), delimiter=",", skiprows=1)
inside = (rows[:, 0] >= FIRST) & (rows[:, 0] < LAST)
table = rows[inside][:, :2]
table[:, 0] -= FIRST
np.savetxt("wheel.csv", table, delimiter=",", header="time,gyro_z", comments="", fmt="%.9g")
