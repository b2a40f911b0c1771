"""Gyro z of the unit at the hub with that of the other read off at its times, by their common clock; and the stand."""

import numpy as np


def unit(trial: str, name: str) -> np.ndarray:
    log = np.genfromtxt(f"raw/Datasets/trial{trial}/{name}.csv", delimiter=",", skip_header=2)[1:, :11]
    log[:, 1] *= 1e-6
    return log


for trial in ("06", "02"):
    hub, radial = unit(trial, "IMU1"), unit(trial, "IMU1_radial")
    there = (hub[:, 1] >= radial[0, 1]) & (hub[:, 1] <= radial[-1, 1])
    hub = hub[there]
    beside = np.interp(hub[:, 1], radial[:, 1], radial[:, 10])
    table = np.column_stack([hub[:, 1] - hub[0, 1], hub[:, 10], beside])
    np.savetxt(f"wheel{trial}.csv", table, delimiter=",", header="time,hub_z,radial_z", comments="", fmt="%.12g")

hub = unit("06", "IMU1")
time = hub[:, 1] - hub[0, 1]
stands = (time >= 57) & (time < 91)
table = np.column_stack([time[stands], hub[stands, 8:11], hub[stands, 5:8]])
head = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt("stands.csv", table, delimiter=",", header=head, comments="", fmt="%.12g")
