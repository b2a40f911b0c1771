"""An MPU-9250 that lies before it is taken up, 200 rows, and all of it, turned about by hand; 80 rows a second."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/log/imu_exp01.log"), delimiter=",")
table = np.column_stack([np.arange(len(rows)) / 80, rows])
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("lies.csv", table[:200], delimiter=",", header=head, comments="", fmt="%.9g")
np.savetxt("turned.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
