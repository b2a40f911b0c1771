"""The rests of two units of an array, one behind the other, with the number of each rest."""

import numpy as np
from scipy.io import loadmat

rests = loadmat("raw/imu_static_measurements/data_static.mat", squeeze_me=True, struct_as_record=False)["data_static"]
for unit in (1, 3):
    rows = [
        np.column_stack((rest.acc[unit - 1].T, np.full(rest.time[unit - 1].size, k))) for k, rest in enumerate(rests)
    ]
    np.savetxt(
        f"unit{unit}.csv",
        np.vstack(rows),
        delimiter=",",
        header="accel_x,accel_y,accel_z,rest",
        comments="",
        fmt="%.12g",
    )
