"""A lever: times in s, its encoder in degrees, with the sign of the gyro about its axle, and its gyros in rad/s."""

from pathlib import Path

import numpy as np

FILES = {"rapid": "rapid_moves", "hold": "static_hold"}
for name, test in FILES.items():
    file = next(Path("raw").rglob(f"gyro_integrated_vector/iteration_1/{test}/*.csv"))
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    table = np.column_stack([1e-3 * rows[:, 0], -rows[:, 1], rows[:, 4:]])
    header = "time,angle,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
