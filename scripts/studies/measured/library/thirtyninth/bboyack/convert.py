"""Two units on a golf cart: the gyro of a laser scanner (x, z) beside that of an inertial unit, 100 rows a second.

The inertial unit hangs with its z down, so that z is turned about. Rows are put together by their stamps.
"""

from pathlib import Path

import numpy as np

rows = np.genfromtxt(Path("raw/data/sorted_imu_data.csv"), delimiter=",", skip_header=1)
table = np.column_stack([rows[:, 1] - rows[0, 1], rows[:, 9], rows[:, 2], -rows[:, 11], rows[:, 4]])
head = "time_s,unit_x_rad_s,scanner_x_rad_s,unit_z_rad_s,scanner_z_rad_s"
np.savetxt("cart.csv", table, delimiter=",", header=head, comments="", fmt="%.10g")
