"""A telephone at rest: its gyros and its accelerometers of the same times."""

from pathlib import Path

import numpy as np

gyros, accels = (
    np.loadtxt(Path("raw/data") / f"noise_{kind}.csv", delimiter=",", skiprows=1) for kind in ("Gyr", "Acc")
)
if not np.array_equal(gyros[:, 1], accels[:, 1]):
    raise ValueError("two clocks")
table = np.column_stack([gyros[:, 1], gyros[:, :1:-1], accels[:, :1:-1]])
header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt("phone.csv", table, delimiter=",", header=header, comments="", fmt="%.12g")
