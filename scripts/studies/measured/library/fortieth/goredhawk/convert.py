"""An Xsens unit: at rest towards the west and the north, in a parked car twice, and in the car as it drives.

Its files have a head of five lines, some with a column of sample times that is left out; rows are 10 ms apart (the
counter, at 400 a second, says so where it steps by four). About z stands the rate that the unit's own attitude tells:
d(yaw)/dt cos(roll) cos(pitch) - d(pitch)/dt sin(roll).
"""

from pathlib import Path

import numpy as np

LOGS = {"west": "west-000", "north": "north-000", "car1": "INS_Static1-000", "car2": "INS_Static2-000"}


def read(log: str) -> dict[str, np.ndarray]:
    file = next(Path("raw").rglob(f"{log}.txt"))
    lines = file.read_text(encoding="latin-1").splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("PacketCounter"))
    names = lines[head].split()
    rows = np.array([[float(x) for x in line.split("\t")[: len(names)]] for line in lines[head + 1 :] if line.strip()])
    return dict(zip(names, rows.T, strict=True))


for name, log in LOGS.items():
    held = read(log)
    table = np.column_stack([held[f"{kind}_{axis}"] for kind in ("Acc", "Gyr") for axis in "XYZ"])
    time = np.arange(len(table)) / 100
    head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"{name}.csv", np.column_stack([time, table]), delimiter=",", header=head, comments="", fmt="%.9g")
held = read("INS_sport2-000")
roll, pitch, yaw = (np.unwrap(np.radians(held[angle])) for angle in ("Roll", "Pitch", "Yaw"))
time = np.arange(len(roll)) / 100
rate = np.gradient(yaw, time) * np.cos(roll) * np.cos(pitch) - np.gradient(pitch, time) * np.sin(roll)
table = np.column_stack([time, rate, held["Gyr_Z"]])
np.savetxt("drive.csv", table, delimiter=",", header="time_s,rate_z,gyro_z", comments="", fmt="%.9g")
