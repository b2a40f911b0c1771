"""An MPU-9250 at rest, out of the cold beside a thermometer and at room temperature: counts, ten rows a second.

The logs have no times: a row is taken as 0.1 s. Rows of three numbers are readings; the thermometer has one to each.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/data/gyroscope/data_no_ofs")


def readings(name: str) -> np.ndarray:
    """Time [s] and the three gyros [counts] of a log, shape (rows, 4)."""
    lines = (RAW / name).read_text(encoding="utf-8").splitlines()
    rows = np.array([line.split() for line in lines if len(line.split()) == 3], float)
    return np.column_stack([np.arange(len(rows)) * 0.1, rows])


def write(name: str, head: str, table: np.ndarray) -> None:
    np.savetxt(name, table, delimiter=",", header=head, comments="", fmt="%.10g")


warm = readings("gyro_zero_ofs.txt")
temperature = np.array((RAW / "temperature.txt").read_text(encoding="utf-8").split(), float)
if len(temperature) != len(warm):
    raise SystemExit("gyros and thermometer have rows of their own")
write("warm.csv", "time_s,gyro_x,gyro_y,gyro_z,temp_c", np.column_stack([warm, temperature]))
write("rest.csv", "time_s,gyro_x,gyro_y,gyro_z", readings("gyro_no_movement.txt"))
