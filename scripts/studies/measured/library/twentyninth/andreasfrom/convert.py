"""A model car that drives circles of 0.5 m at the speed that it is told: its gyro beside the rate of the circle.

One run for each speed. Rows whose millisecond is that of the row before are left out.
"""

from pathlib import Path

import numpy as np


def lines(file):
    """The columns of a file by their names."""
    names, *rest = (line.split(",") for line in file.read_text().splitlines())
    rows = np.array([[float(cell) for cell in row] for row in rest if len(row) == len(names)])
    return {name.strip(): column for name, column in zip(names, rows.T, strict=True)}


for speed in range(3, 11):
    run = lines(Path(f"raw/CCU/Torque-Measurements/v{speed / 10:.1f}.csv"))
    time = (run["timestamp"] - run["timestamp"][0]) / 1000
    new = np.r_[True, np.diff(time) > 0]
    table = np.column_stack([time, run["setpoint"] / run["setpoint_radius"], run["gyro_z"]])[new]
    head = "time_s,circle_rad_s,gyro_z_dps"
    np.savetxt(f"speed_{speed}.csv", table, delimiter=",", header=head, comments="", fmt="%.8g")
