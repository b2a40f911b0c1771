"""A Sense HAT (ICM-20948) in counts on a table at three rows a second, and the same as it is turned about by hand."""

from datetime import datetime
from pathlib import Path

import numpy as np

RAW = Path("raw/Testing Data Sets/Sense HAT B data")
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp"
for name, log, first, last in (("rest", "2000", 0, 1070), ("turned", "Yaw", 0, 300)):
    words = [line.split(",") for line in (RAW / f"{log}.csv").read_text().splitlines()[1:]]
    times = [datetime.fromisoformat(row[0]) for row in words]
    held = np.array([[(t - times[0]).total_seconds(), *map(float, r[1:])] for t, r in zip(times, words, strict=True)])
    table = held[first:last][:, [0, 4, 5, 6, 7, 8, 9, 10]]
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
