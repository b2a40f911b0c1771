"""The part of the drive in which the car stands with its engine on, from 360 to 403 s."""

import numpy as np

log = np.genfromtxt("raw/lab5/data/first_test/town_imu.csv", delimiter=",", skip_header=1)
still = log[(log[:, 2] >= 360) & (log[:, 2] < 403)]
head = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
np.savetxt("town_stop.csv", still[:, [2, *range(9, 15)]], delimiter=",", header=head, comments="", fmt="%.9g")
