"""A Sense HAT (ICM-20948) that logs 48 min: two long rests beside its thermometer, and a row of attitudes.

The column of the accelerometers says g; its numbers are those of m/s^2. Times of day in seconds since the first row.
"""

from datetime import datetime
from pathlib import Path

import numpy as np

lines = Path("raw/IMU_Data/IMU_Data_15000_Row.csv").read_text(encoding="utf-8").splitlines()[1:]
words = [line.split(",") for line in lines]
times = [datetime.fromisoformat(row[0]) for row in words]
start = times[0]
held = np.array([[(t - start).total_seconds(), *map(float, row[1:])] for t, row in zip(times, words, strict=True)])
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp"
for name, first, last in (("morning", 1000, 4600), ("cools", 8500, 13000), ("faces", 900, 15000)):
    table = held[first:last][:, [0, 6, 7, 8, 9, 10, 11, 2]]
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
