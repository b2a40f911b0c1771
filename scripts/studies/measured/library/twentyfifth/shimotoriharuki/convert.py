"""A line follower: its gyro [rad/s] each millisecond beside the counts of its right wheel, 0.26 rad/s each.

The size of a count is taken from the recording itself; the counts of the left wheel tell nothing.
"""

from pathlib import Path

import numpy as np

COUNT = 0.26
here = next(Path("raw").rglob("Omega.txt")).parent
gyro, right = (np.loadtxt(here / f"{name}.txt") for name in ("Omega", "right_M"))
last = int(np.flatnonzero(gyro)[-1])
table = np.column_stack([1e-3 * np.arange(last), gyro[:last], COUNT * right[:last]])
np.savetxt("sequence.csv", table, delimiter=",", header="time,gyro,wheel", comments="", fmt="%.9g")
