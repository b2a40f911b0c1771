"""Gyros and accelerometers, kept in two files of the same rows, of the time in which the car stands."""

import numpy as np

gyro, accel = (np.loadtxt(f"raw/{n}_data.csv", delimiter=",", skiprows=1)[50:1340] for n in ("gyro", "accel"))
assert np.array_equal(gyro[:, 0], accel[:, 0])
np.savetxt(
    "standing.csv",
    np.column_stack([gyro, accel[:, 1:]]),
    fmt="%.9g",
    delimiter=",",
    header="t,gx,gy,gz,ax,ay,az",
    comments="",
)
