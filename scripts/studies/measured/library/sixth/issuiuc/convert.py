"""Telemetry of a rocket on its pad, in the order of its times: the file is sorted by their text.

`2024-3-23--13-41-39-25` is 25 ms after 13:41:39. The first 95 s hold seventy rows between gaps and are left out, and so
is what follows 729 s (the ignition).
"""

import csv
from datetime import datetime, timedelta

import numpy as np

COLUMNS = ("IMU_gx", "IMU_gy", "IMU_gz", "KX_IMU_ax", "KX_IMU_ay", "KX_IMU_az", "TEMP")


def moment(text: str) -> datetime:
    """Time of a row."""
    day, clock = text.split("--")
    *hours, thousandths = map(int, clock.split("-"))
    return datetime(*map(int, day.split("-")), *hours) + timedelta(milliseconds=thousandths)


with open("raw/20240323/Kairos-Sustainer-March-MIDAS.csv", newline="") as file:
    found = sorted((moment(row["Time"]), [float(row[c]) for c in COLUMNS]) for row in csv.DictReader(file))
time = np.array([(at - found[0][0]).total_seconds() for at, _ in found])
rows = np.column_stack([time, [numbers for _, numbers in found]])[(time >= 95.0) & (time <= 729.0)]
np.savetxt("pad.csv", rows, delimiter=",", header=",".join(("time", *COLUMNS)), comments="", fmt="%.9g")
