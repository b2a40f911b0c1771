"""Turn of a sensor in the hand from its own fused quaternions ("r" lines), beside its gyro ("g" lines)."""

from pathlib import Path

import numpy as np

lines = [line.strip().split(",") for line in Path("raw/rotation_test.csv").read_text().splitlines()]
r = np.array([[float(x) for x in line[1:6]] for line in lines if line[0] == "r"])
g = np.array([[float(line[k]) for k in (5, 1, 2, 3)] for line in lines if line[0] == "g"])
r = r[np.r_[True, np.diff(r[:, 4]) > 0]]
even = np.arange(r[0, 4], r[-1, 4], 0.01)
q = np.column_stack([np.interp(even, r[:, 4], column) for column in r[:, :4].T])
q /= np.linalg.norm(q, axis=1)[:, None]
a, b = q[:-10], q[10:]
v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
v *= np.sign((a * b).sum(1))[:, None]
rates = 2 * v / 0.1
rows = (g[:, 0] > even[5]) & (g[:, 0] < even[-6])
turned = [np.interp(g[rows, 0], even[5:-5], rate) for rate in rates.T]
table = np.column_stack([g[rows, 0], *turned, g[rows, 1:]])
head = "time_s,fused_x,fused_y,fused_z,gyro_x,gyro_y,gyro_z"
np.savetxt("fused.csv", table, delimiter=",", header=head, comments="", fmt="%.8g")
