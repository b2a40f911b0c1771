"""A satellite in a can that waits on the ground, whole milli-g and mrad/s, ten rows a second.

The first 30 s, and what lies after it has been moved (from 150 s on) beside the thermometer of its barometer.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/telemetry/22-05-18/drop_telemetry/csv/7")
held = np.genfromtxt(RAW / "SCALED_IMU.csv", delimiter=",", skip_header=1)[:, :7]
warm = np.genfromtxt(RAW / "SCALED_PRESSURE.csv", delimiter=",", skip_header=1)
time = held[:, 0] / 1000
temperature = np.interp(time, warm[:, 0] / 1000, warm[:, 3] / 100)
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp"
for name, keep in (("power_on", time < 36), ("waits", time > 150)):
    table = np.column_stack([time - time[keep][0], held[:, 1:], temperature])[keep]
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
