"""An Xsens unit turned in the hand: its gyros, 50 rows a second, beside the rates that its own quaternion tells."""

from pathlib import Path

import numpy as np

rows = []
for line in Path("raw/data_xsens.txt").read_text(encoding="latin-1").splitlines():
    words = line.split()
    if len(words) == 14 and words[0].isdigit():
        rows.append([float(word) for word in words])
held = np.array(rows)
time = (held[:, 0] - held[0, 0]) / 50
q = held[:, 10:14]
q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
(w, x, y, z), (dw, dx, dy, dz) = q.T, np.gradient(q, time, axis=0).T
about_y = 2 * (w * dy - y * dw - z * dx + x * dz)
about_z = 2 * (w * dz - z * dw - x * dy + y * dx)
table = np.column_stack([time, about_y, about_z, held[:, 5:7]])
head = "time_s,rate_y,rate_z,gyro_y,gyro_z"
np.savetxt("turned.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
