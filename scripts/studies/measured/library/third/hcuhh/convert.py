"""The angle about the level z axis from the two other accelerometers; rows in which registers were not read stay in."""

from pathlib import Path

import numpy as np

lines = Path("raw/data/turn.csv").read_text(encoding="utf-8").splitlines()[1:]
log = np.array([line.split(";") for line in lines if line.count(";") == 6], dtype=float)
angle = -np.unwrap(np.degrees(np.arctan2(log[:, 2], log[:, 1])), period=360.0)
table = np.column_stack([log[:, 0] / 1e3, log[:, 6], angle])
np.savetxt("turn.csv", table, delimiter=",", header="time,gyro_z,angle", comments="", fmt="%.7g")
