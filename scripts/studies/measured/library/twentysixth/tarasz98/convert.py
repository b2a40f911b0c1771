"""A robot that balances: gyro about the vertical [deg/s] beside the heading of its wheels [rad], with its sign."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(next(Path("raw").rglob("bal_drive_5.log")), comments="%")
table = np.column_stack([rows[:, 0], rows[:, 7], -np.unwrap(rows[:, 19])])
np.savetxt("drive.csv", table, delimiter=",", header="time,gyro_z,heading", comments="", fmt="%.9g")
