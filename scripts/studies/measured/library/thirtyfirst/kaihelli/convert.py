"""Counts of an accelerometer that was set down in 22 attitudes, fifty rows in each, as a table with names."""

from io import StringIO
from pathlib import Path

import numpy as np

ROWS = 50

counts = np.loadtxt(StringIO(Path("raw/imu_cal/acc3_raw.csv").read_text(encoding="utf-8")), delimiter=",")
table = np.column_stack([np.arange(len(counts)) // ROWS + 1, counts])
np.savetxt("attitudes.csv", table, delimiter=",", header="attitude,accel_x,accel_y,accel_z", comments="", fmt="%d")
