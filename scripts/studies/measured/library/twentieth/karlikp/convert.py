"""Messages of a mobile robot's unit, as ROS writes them to a table, with the heading of their quaternions."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

NAMES = [f"angular_velocity.{axis}" for axis in "xyz"] + [f"linear_acceleration.{axis}" for axis in "xyz"]
for run in (1, 3, 8):
    path = Path("raw/lib/Slam_2D/sensordata") / f"exp{run}_imu.csv"
    with path.open() as file:
        names = [name.removeprefix("field.") for name in file.readline().strip().split(",")]
    at = {name: k for k, name in enumerate(names)}
    wanted = ["header.stamp", *(f"orientation.{part}" for part in "xyzw"), *NAMES]
    rows = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=[at[name] for name in wanted])
    heading = np.unwrap(Rotation.from_quat(rows[:, 1:5]).as_euler("ZYX")[:, 0])
    table = np.column_stack([(rows[:, 0] - rows[0, 0]) / 1e9, rows[:, 5:], heading])
    header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,heading"
    np.savetxt(f"exp{run}.csv", table, delimiter=",", header=header, comments="", fmt="%.12g")
