"""Angles and rates of a quadcopter, a row every 0.03 s as the owner says; each angle's rate stands behind it."""

from pathlib import Path

import numpy as np

rows = np.loadtxt(Path("raw/Data/Quadcopter_Datasets") / "dataset_1.csv", delimiter=",")[:, :6]
table = np.column_stack([0.03 * np.arange(len(rows)), rows])
header = "time,roll,roll_rate,pitch,pitch_rate,yaw,yaw_rate"
np.savetxt("flown.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
