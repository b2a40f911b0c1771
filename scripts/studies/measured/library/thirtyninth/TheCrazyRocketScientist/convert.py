"""An ADXL345 on a glass panel that is tapped, up to the first break, 280 s: counts of 1/256 of gravity.

Times are those of arrival over a network, 42 rows a second on the mean.
"""

from datetime import datetime
from pathlib import Path

import numpy as np

lines = Path("raw/data/imu_data.csv").read_text(encoding="utf-8").splitlines()[1:11687]
parts = [line.split(",") for line in lines]
first = datetime.fromisoformat(parts[0][0])
table = [[(datetime.fromisoformat(p[0]) - first).total_seconds(), *map(float, p[1:4])] for p in parts]
np.savetxt("panel.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
