"""Gyros z of small IMUs on a ground robot beside the turn about the vertical of a Tango, at the IMUs' times.

Rows in which the Tango was lost (more than 0.2 s without an attitude) are left out; rows of a unit
are put in the order of their stamps.
"""

import numpy as np
from scipy.spatial.transform import Rotation

HERE = "raw/MagPIE/dataset/Talbot_UGV/magpie2Dataset"

for run, unit in ((2, 1), (2, 3), (1, 4)):
    tango = np.loadtxt(f"{HERE}_{run}_tango_start.csv", delimiter=",", skiprows=1)
    imu = np.loadtxt(f"{HERE}_{run}_imu{unit}.csv", delimiter=",", skiprows=1)
    imu = imu[np.argsort(imu[:, 0])]
    known, time = (1e-9 * (t - tango[0, 0]) for t in (tango[:, 0], imu[:, 0]))
    attitude = Rotation.from_quat(tango[:, 4:8])
    turned = (attitude[1:] * attitude[:-1].inv()).as_rotvec()[:, 2]
    heading = np.interp(time, known, np.concatenate([[0.0], np.cumsum(turned)]))
    after = np.clip(np.searchsorted(known, time), 1, known.size - 1)
    seen = (time >= known[0]) & (time <= known[-1]) & (known[after] - known[after - 1] < 0.2)
    rows = np.column_stack([time, imu[:, 3], heading])[seen]
    name = f"ugv{run}_imu{unit}.csv"
    np.savetxt(name, rows, delimiter=",", header="time,gyro_z,heading", comments="", fmt="%.15g")
