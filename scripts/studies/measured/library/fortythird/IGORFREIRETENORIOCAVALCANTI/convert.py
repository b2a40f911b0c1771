"""The first 16 s of a telephone that lies before it is taken up, at 62 Hz."""

import csv
from pathlib import Path

import numpy as np

with Path("raw/1/TotalAcceleration.csv").open(encoding="utf-8") as file:
    rows = [[float(row[column]) for column in ("seconds_elapsed", "x", "y", "z")] for row in csv.DictReader(file)]
held = np.array(rows)
held = held[held[:, 0] < 16.0]
np.savetxt("lies.csv", held, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
