"""Temperature counts to degC: 16-bit numbers that wrap below zero, 256 to the degree, zero at 25 degC."""

import numpy as np

raw = np.genfromtxt("raw/MATLAB/sensor_models/TVCtest3_7_20.csv", delimiter=",", skip_header=1)
counts = (raw[:, 7] + 2**15) % 2**16 - 2**15
table = np.column_stack([raw[:, 0] / 1000, raw[:, 4:7], 25 + counts / 256])
head = "time,gyro_x,gyro_y,gyro_z,temperature"
np.savetxt(
    "cold_soak.csv", table, delimiter=",", header=head, comments="", fmt=["%.3f", "%.5g", "%.5g", "%.5g", "%.6g"]
)
