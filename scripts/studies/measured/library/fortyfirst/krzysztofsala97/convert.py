"""Eight inertial units of a sleeve on six faces, at 400 Hz, and the first six seconds of one that lies with z up.

Rows that begin with 0 hold, behind a time in seconds, of each unit gyro, accelerometer and magnetometer. The owner's
steps are 0.000366211 (12 g in 32768) of the accelerometers and 0.00106526 (2000 deg/s in 32768, in rad/s) of the
gyros; the accelerometers read 1.5 where gravity is 1 g. Of each face stand means of half a second, its number the
segment.
"""

from pathlib import Path

import numpy as np

FACES = ("X_up", "X_down", "Y_up", "Y_down", "Z_up", "Z_down")


def read(face: str) -> np.ndarray:
    lines = Path(f"raw/data/MMG_calib_{face}.csv").read_text().splitlines()
    return np.array([[float(x) for x in line.split(",")] for line in lines if line.startswith("0,")])


held = {face: read(face) for face in FACES}
for name, unit in {"second": 1, "eighth": 7}.items():
    rows = []
    for number, face in enumerate(FACES):
        acc = held[face][:4000, 2 + 9 * unit + 3 : 2 + 9 * unit + 6]
        rows += [[number, *mean] for mean in acc.reshape(20, 200, 3).mean(axis=1)]
    table = np.column_stack([np.arange(len(rows)) * 0.5, np.array(rows)])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,face,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
lies = held["Z_up"]
table = np.column_stack([np.arange(len(lies)) / 400, lies[:, 2 + 9 * 6 : 2 + 9 * 6 + 6]])
head = "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z"
np.savetxt("lies.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
