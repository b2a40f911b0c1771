"""Accelerometer of a unit in a car in counts (16384 to a g), one line a row, without a time; no broken lines."""

import re
from pathlib import Path

import numpy as np

LINE = re.compile(r'accel:\{"x":(-?\d+),y:(-?\d+),z:(-?\d+)\}')
text = Path("raw/Large-dataset/IMU-raw-data.txt").read_text(encoding="utf-8", errors="replace")
table = np.array([[int(x) for x in found] for found in LINE.findall(text)])
np.savetxt("car.csv", table, delimiter=",", header="acc_x,acc_y,acc_z", comments="", fmt="%d")
