"""Gyro of a small board that lies still after it was turned about, a reading a second, the stamps rounded."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/Task6.1P/gyroscope_data.csv"), delimiter=",", skiprows=1)[225:]
rows[:, 0] = np.arange(len(rows))
np.savetxt("lies.csv", rows, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")
