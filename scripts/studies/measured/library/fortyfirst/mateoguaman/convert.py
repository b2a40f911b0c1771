"""An LSM9DS1 that lies still, one that is left tilted, and one that is tilted by hand; no times are told."""

from pathlib import Path

import numpy as np


def read(log: str) -> np.ndarray:
    lines = Path(f"raw/{log}.txt").read_text().splitlines()[1:]
    rows = [line.split() for line in lines]
    return np.array([[float(x) for x in row] for row in rows if len(row) == 10])


head = "row,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
for name, (log, last) in {"still": ("still", None), "tilted": ("test", 1000), "turned": ("tilt", None)}.items():
    held = read(log)[:last]
    table = np.column_stack([np.arange(len(held)), held[:, 4:10]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
