"""Turns of a micromouse on the spot: the commanded turn rate and the gyro, a thousand times a second."""

from pathlib import Path

import numpy as np

FILES = {
    "old_robot": "20200428-data/2-rot-fb/20200429-001644.csv",
    "new_robot": "20201123-data-v5-tuning/20201122-232939.csv",
    "noise_test": "20211226-data-v4c-gyro-noise/20211226-104358.csv",
}
for name, file in FILES.items():
    rows = np.loadtxt(Path("raw/firmware/tools/pid/data") / file, delimiter="\t")
    table = np.column_stack([np.arange(len(rows)) * 1e-3, rows[:, 9], rows[:, 8]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro,command", comments="", fmt="%.9g")
