"""The accelerometer of a model car that stands, 15 s at 234 Hz; of 3580 times 100 repeat, so the rows count here."""

import csv
from pathlib import Path

import numpy as np

with Path("raw/python/acc_noise_data_fast.csv").open(encoding="utf-8") as file:
    rows = [
        [float(row[key]) for key in ("Program Time [s]", "data 0", "data 1", "data 2")] for row in csv.DictReader(file)
    ]
held = np.array(rows)
held[:, 0] = np.linspace(0.0, held[-1, 0] - held[0, 0], len(held))
np.savetxt("fast.csv", held, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
