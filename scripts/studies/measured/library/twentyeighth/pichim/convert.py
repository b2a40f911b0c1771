"""The motors' board of a two-wheeled robot at rest: time and the three rates from Matlab's structure."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

for name in ("42Hz", "188Hz"):
    held = loadmat(Path("raw/docs/matlab/dev/imu") / f"data_imu_{name}.mat", squeeze_me=True)
    data = held[next(key for key in held if not key.startswith("_"))]
    rows = np.column_stack([data["time"].item(), data["values"].item()[:, 8:11]])
    np.savetxt(f"rest_{name}.csv", rows, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="", fmt="%.8g")
