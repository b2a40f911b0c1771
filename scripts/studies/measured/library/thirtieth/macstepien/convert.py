"""Position and velocity of one joint at the times of their stamps, once each."""

import csv
from pathlib import Path

import numpy as np

RAW = Path("raw/furuta_pendulum_model/data")
STAMP = "/joint_states/header/stamp"

for file, joint, out in (
    ("hardware_pure_joint1_oscillations.csv", "joint1", "pendulum.csv"),
    ("hardware_signal_response.csv", "joint0", "arm.csv"),
):
    names = (STAMP, f"/joint_states/{joint}/position", f"/joint_states/{joint}/velocity")
    with (RAW / file).open(encoding="utf-8", newline="") as lines:
        rows = [[float(row[name]) for name in names] for row in csv.DictReader(lines) if row[STAMP]]
    table = np.array(rows)[np.unique([row[0] for row in rows], return_index=True)[1]]
    table[:, 0] -= table[0, 0]
    np.savetxt(out, table, delimiter=",", header="time_s,position,velocity", comments="", fmt="%.9f")
