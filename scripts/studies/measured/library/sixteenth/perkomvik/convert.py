"""Gyro z of a skid-steered robot beside its four wheel encoders: counts of 2.2 mm, a track of 0.7 m."""

import numpy as np

wheels, unit = np.load("raw/HW2/Encoders23.npz"), np.load("raw/HW2/Imu23.npz")
right = wheels["counts"][[0, 2]].mean(axis=0)
left = wheels["counts"][[1, 3]].mean(axis=0)
angle = np.cumsum(right - left) * 0.0022 / 0.7
at, t = wheels["time_stamps"].ravel(), unit["time_stamps"].ravel()
np.savez("run23.npz", t=t - at[0], gz=unit["angular_velocity"][2], wheels=np.interp(t, at, angle))
