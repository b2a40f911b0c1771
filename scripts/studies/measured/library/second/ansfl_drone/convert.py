"""Gyro y of unit 4 with that of unit 1 read off at its times, by the units' common clock of microseconds."""

from pathlib import Path

import numpy as np


def gyro_y(unit: int) -> tuple[np.ndarray, np.ndarray]:
    (file,) = Path("raw/StraightLine/RAW").glob(f"*DOT{unit}_*.csv")
    log = np.genfromtxt(file, delimiter=",", skip_header=2)
    return log[:, 0] * 1e-6, log[:, 8]


(time, own), (other, reference) = gyro_y(4), gyro_y(1)
there = (time >= other[0]) & (time <= other[-1])
table = np.column_stack([time[there], own[there], np.interp(time[there], other, reference)])
np.savetxt("pair.csv", table, delimiter=",", header="time,dot4,dot1", comments="", fmt="%.12g")
