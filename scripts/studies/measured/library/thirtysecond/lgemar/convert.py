"""Time in seconds and the columns of accelerometers and gyros; of the third test the minute after it is put down."""

import numpy as np

FOLDER = "raw/Analysis/Analysis-3-17/Data/Sensor"
head = "time_s,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z"
for name, first, last in (("no_manuever1", 0, None), ("all3", 1300, 3880)):
    rows = np.genfromtxt(f"{FOLDER}/{name}.csv", delimiter=",")[first:last]
    table = np.column_stack(((rows[:, 0] - rows[0, 0]) / 1e3, rows[:, 5:11]))
    np.savetxt(f"{name}.csv", table, fmt=["%.3f"] + ["%.2f"] * 6, delimiter=",", header=head, comments="")
