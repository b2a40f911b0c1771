"""Heading by the four wheels (2.2 mm to the count) and the drawing's track, read off at the gyro's times."""

import numpy as np

COUNT = 0.0022
#: Half of the inner and the outer width of the robot together [m].
TRACK = (0.31115 + 0.47625) / 2

for run in (20, 21):
    wheels, unit = np.load(f"raw/data/Encoders{run}.npz"), np.load(f"raw/data/Imu{run}.npz")
    right, left = (wheels["counts"][[k, k + 2]].sum(axis=0) / 2 for k in (0, 1))
    heading = np.cumsum(right - left) * COUNT / TRACK
    time, passed = unit["time_stamps"], wheels["time_stamps"]
    there = (time >= passed[0]) & (time <= passed[-1])
    angle = np.interp(time[there], passed, heading)
    table = np.column_stack([time[there] - passed[0], unit["angular_velocity"][2][there], angle])
    np.savetxt(f"robot{run}.csv", table, delimiter=",", header="time,gyro_z,heading", comments="", fmt="%.12g")
