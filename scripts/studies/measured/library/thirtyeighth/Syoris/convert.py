"""A bicycle that a flywheel balances, as its program logs it, 100 rows a second.

The encoder of the flywheel stands beside the speed that the program filters out of it, the gyro, before and after a
filter, beside the lean of the unit's own attitude. The first two rows hold what stood in memory before.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

RAW = Path("raw/Simulations/PythonData")
COLUMNS = ("Time", "FW_Angle", "FW_Speed", "Bike_Angle", "Bike_AngularVel_Raw", "Bike_AngularVel")
for name, log in {"five_minutes": "Velo_5min", "stabilized": "Velo_Stab_115sec"}.items():
    held = loadmat(RAW / f"{log}.mat", squeeze_me=True)
    table = np.column_stack([held[column] for column in COLUMNS])[2:]
    head = "time_s,wheel_deg,wheel_deg_s,lean_deg,gyro_raw_deg_s,gyro_deg_s"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
