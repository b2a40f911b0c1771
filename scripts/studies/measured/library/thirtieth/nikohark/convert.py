"""Logs of a telephone in the order of their times, as tables with names; heading from the fused attitude."""

from pathlib import Path

import numpy as np

RAW = Path("raw/logs/dcaiti_sensor_project")


def log(drive: str, sensor: str) -> np.ndarray:
    """Rows of time in ns and values, in the order of time."""
    (file,) = (RAW / drive).glob(f"{sensor}Log*.csv")
    rows = np.loadtxt(file, delimiter=",")
    return rows[np.argsort(rows[:, 0], kind="stable")]


for sensor, out in (("gyroscope", "gyro.csv"), ("accel", "accel.csv")):
    rows = log("1448469804269_static", sensor)
    table = np.column_stack([(rows[:, 0] - rows[0, 0]) / 1e9, rows[:, 1:4]])
    np.savetxt(out, table, delimiter=",", header="time_s,x,y,z", comments="", fmt="%.9g")

gyro, attitude = (log("1448470602786_fast_closed_loop", sensor) for sensor in ("gyroscope", "orientation"))
x, y, z, w = attitude[:, 1:5].T
heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2)))
start = gyro[0, 0]
at = np.interp((gyro[:, 0] - start) / 1e9, (attitude[:, 0] - start) / 1e9, heading)
table = np.column_stack([(gyro[:, 0] - start) / 1e9, gyro[:, 3], at])
np.savetxt("loop.csv", table, delimiter=",", header="time_s,gyro_z,heading_rad", comments="", fmt="%.9g")
