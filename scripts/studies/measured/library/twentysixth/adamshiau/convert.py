"""Logs of units with fibre-optic gyros: times, gyros, accelerometers and a thermometer while nobody touches them."""

from pathlib import Path

import numpy as np

LOGS = {
    "warm": ("Aegiverse_GUI/HINS/HINS_Ver2.0/0128.txt", 1600),
    "start": ("Aegiverse_GUI/IRIS1/IRIS_IMU_Ver2.1/0825.txt", 1200),
    "optic": ("Aegiverse_GUI/IRIS1/IRIS_IMU_Ver2.3/09-15.txt", None),
    "closed": ("Aegiverse_API/0_v4_readPig/0917.txt", None),
}
HEADER = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,temperature"
for name, (log, last) in LOGS.items():
    rows = [line.split(",") for line in (Path("raw") / log).read_text(encoding="utf-8").splitlines()[2:]]
    full = max(map(len, rows))
    table = np.array([[float(cell) for cell in row[:8]] for row in rows if len(row) == full])[:last]
    header = HEADER if full > 3 else "time,fog,temperature"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
