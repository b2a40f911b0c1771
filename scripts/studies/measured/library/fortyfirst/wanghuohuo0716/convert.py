"""A car of the KITTI recordings: its rate about z beside that of the heading that its navigation tells, 10 Hz."""

from pathlib import Path

import numpy as np

imu = np.genfromtxt(Path("raw/data/imu_data.txt"), skip_header=1)
held = np.genfromtxt(Path("raw/data/tf_data.txt"), skip_header=1)
time = held[:, 0]
q = held[:, [7, 4, 5, 6]]
q = q / np.linalg.norm(q, axis=1)[:, None]
q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
(w, x, y, z), (dw, dx, dy, dz) = q.T, np.gradient(q, time, axis=0).T
rate = 2 * (w * dz - x * dy + y * dx - z * dw)
table = np.column_stack([time, rate, imu[:, 7]])
np.savetxt("drive.csv", table, delimiter=",", header="time_s,rate_z,gyro_z", comments="", fmt="%.9g")
