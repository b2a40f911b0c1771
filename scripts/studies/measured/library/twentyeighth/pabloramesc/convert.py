"""A platform of three axes: the turn of its head from the encoders, beside the gyro on it.

Columns of `data`: time [s] in steps of 10 ms, three angles [deg] (roll and pitch of encoders, yaw as commanded), three
accelerations, three rates [deg/s], three of the magnetometer, and the time a row took [ms]. The times are summed from
the last column; the rates of the body follow from the angles.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

for speed in ("mega", "ultra", "legend"):
    data = loadmat(Path("raw/matlab/datasets/platform") / f"turn_XYZ_{speed}.mat")["data"]
    time = np.cumsum(data[:, 13]) / 1e3
    roll, pitch, yaw = np.unwrap(np.radians(data[:, 1:4]), axis=0).T
    p, q, r = (np.gradient(angle, time) for angle in (roll, pitch, yaw))
    x = p + r * np.sin(pitch)
    z = q * np.sin(roll) + r * np.cos(pitch) * np.cos(roll)
    rows = np.column_stack([time - time[0], np.degrees(x), np.degrees(z), data[:, 7], data[:, 9]])
    head = "time_s,encoder_x_dps,encoder_z_dps,gyro_x_dps,gyro_z_dps"
    np.savetxt(f"{speed}.csv", rows, delimiter=",", header=head, comments="", fmt="%.8g")
