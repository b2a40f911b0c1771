"""Three rests of the unit between the turns, each a table of its own, rows as the owner numbers them."""

import numpy as np

rows = np.genfromtxt("raw/notebooks/data/example_sensor_calibration.csv", delimiter=",", skip_header=1)
head = "time_s,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
for name, first, last in (("first", 0, 9519), ("second", 10190, 17170), ("third", 21800, 30543)):
    part = rows[first:last]
    table = np.column_stack((part[:, 7] - part[0, 7], part[:, 1:7]))
    np.savetxt(f"{name}.csv", table, fmt=["%.6f"] + ["%.12g"] * 6, delimiter=",", header=head, comments="")
