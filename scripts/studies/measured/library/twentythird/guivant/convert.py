"""A small vehicle's unit before and while it drives: accelerometers in g, rates in rad/s, times in units of 0.1 ms."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

unit = loadmat(Path("raw/P1_z5146927_ZHAO_Runkai") / "IMU_dataC.mat", squeeze_me=True, struct_as_record=False)["IMU"]
time = 1e-4 * (unit.times.astype(float) - float(unit.times[0]))
np.savetxt(
    "unit.csv",
    np.column_stack((time, unit.DATAf[:6].T)),
    delimiter=",",
    header="time,ax,ay,az,gx,gy,gz",
    comments="",
    fmt="%.9g",
)
