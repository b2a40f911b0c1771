"""A quadcopter's flight: the rate about z, and about x, as its computer tells it, beside that of its own quaternion."""

from pathlib import Path

import numpy as np

LOG = Path("raw/data/rtk_vision/03_19_48_vision_rtk_fuse_vehicle_attitude_0.csv")
held = np.genfromtxt(LOG, delimiter=",", names=True)
time = (held["timestamp"] - held["timestamp"][0]) * 1e-6
q = np.column_stack([held[f"q{k}"] for k in range(4)])
q = q * np.cumprod(np.r_[1, np.sign(np.sum(q[1:] * q[:-1], axis=1))])[:, None]
(w, x, y, z), (dw, dx, dy, dz) = q.T, np.gradient(q, time, axis=0).T
rates = {"z": (w * dz - x * dy + y * dx - z * dw, "yawspeed"), "x": (w * dx - x * dw - y * dz + z * dy, "rollspeed")}
for axis, (rate, name) in rates.items():
    table = np.column_stack([time, 2 * rate, held[name]])
    np.savetxt(f"about_{axis}.csv", table, delimiter=",", header="time_s,rate,gyro", comments="", fmt="%.9g")
