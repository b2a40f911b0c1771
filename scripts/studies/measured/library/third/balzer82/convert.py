"""Yaw rate beside the course over ground, turned round to count as the gyro does, read off between the receiver's news.

Rows repeat the receiver's last course until there is another; below 5 km/h it says nothing of where the car points.
"""

import csv

import numpy as np

with open("raw/2014-03-26-000-Data.csv", encoding="utf-8") as file:
    log = np.array([[float(row[k]) for k in ("millis", "yawrate", "speed", "course")] for row in csv.DictReader(file)])
time = (log[:, 0] - log[0, 0]) / 1e3
news = np.concatenate([[True], (np.diff(log[:, 2:], axis=0) != 0).any(axis=1)]) & (log[:, 2] > 5)
angle = -np.unwrap(log[news, 3], period=360.0)
there = (time >= time[news][0]) & (time <= time[news][-1])
table = np.column_stack([time[there], log[there, 1], np.interp(time[there], time[news], angle)])
np.savetxt("car.csv", table, delimiter=",", header="time,yaw_rate,angle", comments="", fmt="%.12g")
