"""The reference's azimuth or heading at the gyro's times, turned round as the gyro counts; and the car's stand."""

import numpy as np

car = np.genfromtxt("raw/Toronto_Traj_one_IMU_sync.csv", delimiter=",", skip_header=1)
reference = np.genfromtxt("raw/Toronto_Traj_one_REF_sync.csv", delimiter=",", skip_header=1)
there = (car[:, 0] >= reference[0, 0]) & (car[:, 0] <= reference[-1, 0])
angle = np.interp(car[there, 0], reference[:, 0], -np.unwrap(reference[:, 4], period=360.0))
table = np.column_stack([car[there, 0] - car[0, 0], car[there, 6], angle])
np.savetxt("toronto.csv", table, delimiter=",", header="time,gyro_z,angle", comments="", fmt="%.12g")
still = car[car[:, 0] < car[0, 0] + 274]
still[:, 0] -= still[0, 0]
head = "Time Stamp,f_x,f_y,f_z,w_x,w_y,w_z"
np.savetxt("toronto_rest.csv", still, delimiter=",", header=head, comments="", fmt="%.12g")

rover = np.genfromtxt("raw/imu.csv", delimiter=",", skip_header=1, usecols=(2, 19))
reference = np.genfromtxt("raw/ref_solution.csv", delimiter=",")
time, seen = rover[:, 0] * 1e-9, reference[:, 0] * 1e-3
there = (time >= seen[0]) & (time <= seen[-1])
angle = np.interp(time[there], seen, -np.unwrap(reference[:, 3]))
table = np.column_stack([time[there] - seen[0], rover[there, 1], angle])
np.savetxt("rover.csv", table, delimiter=",", header="time,gyro_z,angle", comments="", fmt="%.12g")
