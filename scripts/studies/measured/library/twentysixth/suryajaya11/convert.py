"""Two units on one plate, their counts as the owner scales them: deg/s and g, times in s."""

from pathlib import Path

import numpy as np

SCALES = [1e-3] + [0.000061] * 3 + [0.00875] * 3 + [0.000061036] * 3 + [0.0076295] * 3
UNITS = [f"{unit}_{kind}_{axis}" for unit in ("lsm", "mpu") for kind in ("accel", "gyro") for axis in "xyz"]
for file in Path("raw/raw_data").glob("*.csv"):
    table = np.loadtxt(file, delimiter=",") * SCALES
    np.savetxt(file.name, table, delimiter=",", header=",".join(["time", *UNITS]), comments="", fmt="%.10g")
