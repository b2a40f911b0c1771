"""A Sense HAT (ICM-20948) that is left on a table for nine minutes while somebody works beside it."""

import re
from datetime import datetime
from pathlib import Path

import numpy as np

lines = Path("raw/SenseHAT/Data_3.csv").read_text().splitlines()
words = [line.split(",") for line in lines if re.match(r"\d{4}-", line)]
times = [datetime.fromisoformat(row[0].strip()) for row in words]
held = np.array([[(t - times[0]).total_seconds(), *map(float, r[1:10])] for t, r in zip(times, words, strict=True)])
table = held[:, [0, 4, 5, 6, 7, 8, 9]]
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("table.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
