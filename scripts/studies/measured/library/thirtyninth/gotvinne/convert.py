"""A helicopter that flies on its bench: rates that its unit tells beside those of the encoders, 500 rows a second."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat


def held(name):
    (rows,) = (v for k, v in loadmat(Path(f"raw/Dag 4/Driver/{name}.mat")).items() if not k.startswith("__"))
    return rows


encoders, unit = held("encoders"), held("measurements")
for name, row in (("pitch", 2), ("travel", 5)):
    table = np.column_stack([unit[0], encoders[row], unit[row]])
    head = "time_s,encoder_rad_s,gyro_rad_s"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
