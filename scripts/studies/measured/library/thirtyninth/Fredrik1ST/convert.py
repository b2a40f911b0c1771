"""What the unit of a helicopter on a bench tells, 500 rows a second: it stands still, and it flies."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

for name, log in (("still", "02_IMU_still"), ("flying", "01_IMU_flying")):
    rows = loadmat(Path(f"raw/04 - Kalman Filter/Time Series/{log}.mat"))["IMUdat"][:, [1, 3, 5]]
    table = np.column_stack([np.arange(len(rows)) / 500, rows])[10:]
    head = "time_s,pitch_rad_s,elevation_rad_s,travel_rad_s"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
