"""A robot: its gyro at the stamps of the unit, beside the heading of its wheels [rad] between their own stamps."""

import numpy as np

unit, wheels = (np.loadtxt(f"raw/{name}_log.txt", delimiter=",") for name in ("imu", "odom"))
heading = np.unwrap(2.0 * np.arctan2(wheels[:, 5], wheels[:, 6]))
time = unit[:, -1] - unit[0, -1]
table = np.column_stack([time, unit[:, 6], np.interp(unit[:, -1], wheels[:, -1], heading)])
np.savetxt("robot.csv", table, delimiter=",", header="time,gyro_z,heading", comments="", fmt="%.9g")
