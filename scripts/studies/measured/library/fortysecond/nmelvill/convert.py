"""An MPU-6050 of a slope meter: as it was read, and behind a filter that starts at zero; rows taken as seconds."""

from pathlib import Path

import numpy as np

head = "row,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp"
for name, log, first, last in (("rest", "IMUdata_testSignal", 0, 890), ("filtered", "IMUdata", 480, 1115)):
    held = np.loadtxt(Path("raw") / f"{log}.csv", delimiter=",", skiprows=1)[first:last]
    table = np.column_stack([np.arange(len(held)), held[:, 1:]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
