"""The log's messages of the gyro, with the heading of the odometry (3.4 Hz) read off at their times."""

import csv

import numpy as np

for name in ("rotating", "driving_around"):
    with open(f"raw/src/main/resources/logs/with_gyro/{name}.csv", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    gyro = np.array([(int(m[1]) * 1e-9, float(m[2])) for m in lines if m[0] == "gyro_yaw"])
    odometry = np.array(sorted((int(m[1]) * 1e-9, float(m[4])) for m in lines if m[0] == "odom"))
    passed, heading = odometry[:, 0], np.unwrap(odometry[:, 1])
    gyro = gyro[(gyro[:, 0] >= passed[0]) & (gyro[:, 0] <= passed[-1])]
    table = np.column_stack([gyro[:, 0] - gyro[0, 0], gyro[:, 1], np.interp(gyro[:, 0], passed, heading)])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro,heading", comments="", fmt="%.12g")
