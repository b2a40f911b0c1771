"""A small quadcopter that flies a square, up to its landing: gyro x beside the roll it estimates, 100 rows a second."""

import json
from pathlib import Path

import numpy as np

drone = json.loads(Path("raw/lab07/lab07_square01.json").read_text(encoding="utf-8"))["drone"]
roll, gyro = drone["ae483log.phi"], drone["ae483log.w_x"]
table = np.column_stack([roll["time"], roll["data"], gyro["data"]])
table[:, 0] -= table[0, 0]
table = table[table[:, 0] < 19.5]
np.savetxt("square.csv", table, delimiter=",", header="time_s,roll_rad,gyro_rad_s", comments="", fmt="%.9g")
