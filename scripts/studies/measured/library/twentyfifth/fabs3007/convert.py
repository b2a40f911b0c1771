"""Rocker with two units and an encoder: the unit that swings with it, the angle with the sign of its gyro."""

from pathlib import Path

import numpy as np

FILES = {
    "swing": "Schwingung1_V2",
    "far_swing": "negative_Schwingung_V2",
    "pushed": "impuls_Beschleunigung_V2",
    "printed": "kleineSchwingung",
    "still": "Ruhlage_V2",
}
COLUMNS = ("Time[us]", "Temp1[C]", "gyr1x[dps]", "gyr1y", "gyr1z", "acc1x[m/s2]", "acc1y", "acc1z", "encoder")
for name, stem in FILES.items():
    lines = (Path("raw/Messungen/Wippe") / f"Wippe_{stem}.csv").read_text(encoding="utf-8").splitlines()
    at = [lines[0].split(",").index(column) for column in COLUMNS]
    rows = [line.split(",") for line in lines[1:]]
    table = np.array([[float(row[k]) for k in at] for row in rows if len(row) > max(at)])
    table[:, 0] = 1e-6 * (table[:, 0] - table[0, 0])
    table[:, -1] *= -1.0
    header = "time,temperature,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,angle"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
