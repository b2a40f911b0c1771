"""Raw counts of a log, a row each 100 ms, and the temperature by the data sheet of an MPU-6050."""

import re
from pathlib import Path

import numpy as np

LOG = Path("raw/tools/imu-tool/tests/fixtures/stationary-60s.log")
RAW = re.compile(r"RAW 0x68: accel=\((.*)\) temp_raw=(.*) gyro=\((.*)\)")

found = [RAW.search(line) for line in LOG.read_text(errors="replace").splitlines()]
rows = np.array([[float(n) for n in f"{m[1]},{m[3]},{m[2]}".split(",")] for m in found if m])
rows[:, 6] = rows[:, 6] / 340.0 + 36.53
names = "accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,temperature"
np.savetxt("stationary.csv", rows, delimiter=",", header=names, comments="", fmt="%.7g")
