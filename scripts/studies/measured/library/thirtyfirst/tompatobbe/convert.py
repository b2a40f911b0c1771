"""The wrist of an arm without the rows whose reading failed: there every joint stands at minus half a turn."""

from io import StringIO
from pathlib import Path

import numpy as np

text = Path("raw/data/sysid_run1_20260514_140507.csv").read_text(encoding="utf-8")
rows = np.genfromtxt(StringIO(text), delimiter=",", names=True)
read = np.abs(rows["elbow_pos"] + np.pi) > 1e-3
table = np.column_stack([rows[name][read] for name in ("time", "wrist_rotate_pos", "wrist_rotate_vel")])
head = "time_s,wrist_rotate_pos,wrist_rotate_vel"
np.savetxt("wrist.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
