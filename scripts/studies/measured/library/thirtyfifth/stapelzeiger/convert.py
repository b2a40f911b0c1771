"""A robot on three omni wheels: its gyro, and its turn by the sum of the wheels' counts, read at the gyro's times.

The wheels count against the gyro: their sum is turned round here.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/data")


def numbers(name: str) -> np.ndarray:
    """Rows of a log that begin with a digit; times [us] in the first column."""
    lines = (RAW / name).read_text(encoding="utf-8").splitlines()
    return np.array([line.split(",") for line in lines if line[:1].isdigit()], float)


unit, wheels = numbers("imu_05.csv"), numbers("enc_05.csv")
at, stamps = unit[:, 0] * 1e-6, wheels[:, 0] * 1e-6
turn = -np.interp(at, stamps, wheels[:, 1:].sum(axis=1))
kept = (at >= stamps[0]) & (at <= stamps[-1])
rows = np.column_stack([at - at[0], unit[:, 6], turn])[kept]
np.savetxt("turn.csv", rows, delimiter=",", header="t_s,gz,counts", comments="", fmt="%.7g")
