"""A tracking probe laid on six faces, which its file names row by row, of two units; and the rest for its gyro.

The rows of each face but the first and the last tenth, in which it is set down and taken up; times in microseconds, an
accelerometer that is told to 0.01 g.
"""

import csv
from pathlib import Path

import numpy as np

FACES = ("x+", "x-", "y+", "y-", "z+", "z-")


def faces(number: str, name: str) -> None:
    """Write the rows of the six faces of one unit."""
    with Path(f"raw/data/cal_data_{number}.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    parts = []
    for face, told in enumerate(FACES, start=1):
        held = np.array([[float(r[k]) for k in ("time", "acc_x", "acc_y", "acc_z")] for r in rows if r["dir"] == told])
        held = held[len(held) // 10 : -(len(held) // 10)]
        parts.append(np.column_stack([held, np.full(len(held), face)]))
    table = np.concatenate(parts)
    table[:, 0] = (table[:, 0] - table[0, 0]) * 1e-6
    head = "time_s,acc_x,acc_y,acc_z,face"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")


def rest(number: str) -> None:
    """Write the rows of the gyro before the faces."""
    with Path(f"raw/data/cal_data_{number}.csv").open(encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if r["sensor"] == "gyro"]
    table = np.array([[float(r[k]) for k in ("time", "gyro_x", "gyro_y", "gyro_z")] for r in rows])
    table[:, 0] = (table[:, 0] - table[0, 0]) * 1e-6
    np.savetxt("rest.csv", table, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")


rest("1717418110")
faces("1717418110", "first")
faces("1716669114", "second")
