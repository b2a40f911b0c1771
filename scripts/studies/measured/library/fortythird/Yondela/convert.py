"""A Sense HAT (ICM-20948) in counts that is turned about beside its thermometer, 205 s at 3 Hz."""

from datetime import datetime
from pathlib import Path

import numpy as np

words = [line.split() for line in Path("raw/data/IMU_data.txt").read_text().splitlines()[1:]]
times = [datetime.fromisoformat(f"{row[0]} {row[1]}") for row in words]
held = np.array([[float(x) for x in row[2:]] for row in words])
seconds = [(time - times[0]).total_seconds() for time in times]
table = np.column_stack([seconds, held[:, 3:10]])
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp"
np.savetxt("turned.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
