"""Demonstration data of a simulator: ten seconds of two units that are turned, with a reference that stays at zero."""

from pathlib import Path

import numpy as np

for name in ("bosch", "nxp"):
    here = Path("raw/demo_data_files") / name
    files = ("time", "gyro-0", "accel-0")
    parts = [np.loadtxt(here / f"{file}.csv", delimiter=",", skiprows=1) for file in files]
    header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
    np.savetxt(f"{name}.csv", np.column_stack(parts), delimiter=",", header=header, comments="", fmt="%.10g")
