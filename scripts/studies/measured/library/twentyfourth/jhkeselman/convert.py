"""A vessel's gyro about the vertical beside the heading of its compass, which is given as a quaternion."""

from pathlib import Path

import numpy as np

for name, file in (("spinning", "IMU_data.csv"), ("turning", "MATLAB_scripts/IMU_data/ang_1.csv")):
    with (Path("raw") / file).open() as opened:
        names = opened.readline().split()
        lines = [line.split() for line in opened]
    rows = np.array([[float(cell) for cell in line] for line in lines if len(line) == len(names)])
    at = {column: rows[:, k] for k, column in enumerate(names)}
    yaw = np.unwrap(2.0 * np.arctan2(at["orient_z"], at["orient_w"]))
    table = np.column_stack([at["time"], at["ang_z"], yaw])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro_z,yaw", comments="", fmt="%.10g")
