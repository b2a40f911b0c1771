"""A Sense HAT (ICM-20948) on a table beside the thermometer of its hygrometer; six minutes of 18 in which it rests."""

from datetime import datetime
from pathlib import Path

import numpy as np

lines = Path("raw/ProgressReport2/IMU-data-2021-10-25.csv").read_text().splitlines()[1:]
words = [line.split(",") for line in lines]
times = [datetime.fromisoformat(row[0]) for row in words]
held = np.array([[(t - times[0]).total_seconds(), *map(float, r[1:])] for t, r in zip(times, words, strict=True)])
table = held[1340:2190][:, [0, 1, 2, 3, 12, 13, 14, 7]]
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp"
np.savetxt("rest.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
