"""A Sense HAT at rest, and one on a speaker that plays, 500 whole rows each without a time: rates, forces, field."""

from pathlib import Path

import numpy as np

for name, file in (("rest", "stationeryImu"), ("speaker", "usingPhoneSpeaker")):
    lines = Path(f"raw/data/{file}.csv").read_text(encoding="utf-8").splitlines()[1:]
    words = [line.replace(" ", "").split(",") for line in lines]
    held = np.array([[float(x) for x in row[:6]] for row in words if len(row) == 9])
    table = np.column_stack([np.arange(len(held)), held])
    head = "row,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
