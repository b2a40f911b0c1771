"""Turn of a sensor in the hand from its own fused quaternions, over the two intervals about a row, beside its gyro."""

import numpy as np

data = np.genfromtxt("raw/data/data1.csv", delimiter=",", skip_header=1)
time, q = data[:, 0] - data[0, 0], data[:, 13:17]
a, b = q[:-2], q[2:]
v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
v *= np.sign((a * b).sum(1))[:, None]
rates = 2 * v / (time[2:] - time[:-2])[:, None]
table = np.column_stack([time[1:-1], rates, data[1:-1, 7:10]])
head = "time_s,fused_x,fused_y,fused_z,gyro_x,gyro_y,gyro_z"
np.savetxt("fused.csv", table, delimiter=",", header=head, comments="", fmt="%.8g")
