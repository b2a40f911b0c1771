"""A telephone that is carried: its gyro z and x beside the rates of its own rotation vector, at about 48 Hz.

Times are the sensors' own; the attitude is taken at the times of the gyro.
"""

from pathlib import Path

import numpy as np

lines = [line.split(";") for line in Path("raw/example-log-file.txt").read_text(errors="replace").splitlines()]
gyro = np.array([[float(x) for x in w[2:6]] for w in lines if w[0] == "GYRO"])
held = np.array([[float(x) for x in (w[2], *w[6:9])] for w in lines if w[0] == "AHRS"])
gyro, held = (a[np.r_[True, np.diff(a[:, 0]) > 0]] for a in (gyro, held))
v = held[:, 1:]
q = np.column_stack([np.sqrt(np.maximum(1 - np.sum(v**2, axis=1), 0)), v])
q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
(w, x, y, z), (dw, dx, dy, dz) = q.T, np.gradient(q, held[:, 0], axis=0).T
rates = {"z": 2 * (w * dz - x * dy + y * dx - z * dw), "x": 2 * (w * dx - x * dw - y * dz + z * dy)}
for axis, rate in rates.items():
    time = gyro[:, 0]
    table = np.column_stack([time - time[0], np.interp(time, held[:, 0], rate), gyro[:, 1 + "xyz".index(axis)]])
    np.savetxt(f"about_{axis}.csv", table[5:-5], delimiter=",", header="time_s,rate,gyro", comments="", fmt="%.9g")
