"""One axis of two MPU-9250 on one body, beside each other.

A row has accelerations [cm/s^2], rates [deg/s] and the field; no time, and three rows in 40 ms, as the owner takes
them. The units are read by turns.
"""

import numpy as np

FILES = {
    "updown_x": ("imu{}_data27_16_02_updown.csv", 3),
    "flat_z": ("imu{}_data27_16_13_flat_z.csv", 5),
    "flat_y": ("imu{}_data27_16_20_flat_y.csv", 4),
    "circle_z": ("imu{}_data27_16_51_circle.csv", 5),
    "carried_x": ("old/imu{}_data26_15_53.csv", 3),
    "carried_y": ("old/imu{}_data26_16_12.csv", 4),
}
for name, (file, axis) in FILES.items():
    units = [np.loadtxt(f"raw/imu_data/{file.format(k)}", delimiter=",")[:, axis] for k in (1, 2)]
    n = min(map(len, units))
    rows = np.column_stack([np.arange(n) * 0.04 / 3, *(u[:n] for u in units)])
    np.savetxt(f"{name}.csv", rows, delimiter=",", header="t,unit1,unit2", comments="", fmt="%.9g")
