"""A racing motorcycle's logger, 500 rows a second: rates of its unit, its own lean angle, the receiver's heading."""

import csv
from pathlib import Path

import numpy as np

COLUMNS = ("Time", "rollrate_imu", "yawrate_imu", "pitchrate_imu", "phi_lean", "GPS Heading")
HEADER = "time,roll_dps,yaw_dps,pitch_dps,lean_deg,heading_deg"
FILES = {
    "brake": "Simple-EngineBrake-Example-RCK22/EB-Example.csv",
    "turn": "Simple-TCTarget-vs-Actual-Example-RCK22/log1.csv",
}
for name, file in FILES.items():
    with (Path("raw") / file).open(encoding="latin-1") as opened:
        cells = list(csv.reader(opened))
    head = next(k for k, row in enumerate(cells) if row and row[0] == "Time")
    places = [cells[head].index(column) for column in COLUMNS]
    rows = [[float(row[k]) for k in places] for row in cells[head + 2 :] if len(row) > max(places) and row[0]]
    np.savetxt(f"{name}.csv", np.array(rows), delimiter=",", header=HEADER, comments="", fmt="%.9g")
