"""A maker's example: gyros turned about by hand beside the attitude that the unit's own filter gives."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

with (Path("raw/examples/matlab/csv_read") / "example_data.csv").open() as file:
    names = file.readline().strip().split(",")[1:]
    rows = np.array([[float(x) for x in line.split(",")[1:]] for line in file])
at = {name: rows[:, k] for k, name in enumerate(names)}
angle = body_angles(Rotation.from_quat(np.column_stack([at[f"quat_{part}"] for part in "xyzw"])))
table = np.column_stack([at["sys_time"] / 1e3, *(at[f"gyr_{axis}"] for axis in "xyz"), angle])
header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("turned.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
