"""Gyro z of a skid-steered robot beside the heading of its four wheels, on the gyro's rows.

The counters (front right, front left, rear right, rear left) give what each wheel has rolled since the last reading,
360 counts a turn of 254 mm; right less left over the track of the drawing (the mean of 476.25 and 311.15 mm) is a turn.
The heading is drawn straight between its rows.
"""

import numpy as np
from scipy.io import loadmat

COUNT = np.pi * 0.254 / 360
TRACK = (0.47625 + 0.31115) / 2

for test in (20, 21, 22, 24):
    unit = loadmat(f"raw/data/imu{test}.mat")
    wheels = loadmat(f"raw/data/Encoders{test}.mat")["Encoders"][0, 0]
    counts, seen = wheels["counts"].astype(float), wheels["ts"].ravel()
    turned = ((counts[0] + counts[2]) - (counts[1] + counts[3])) / 2 * COUNT / TRACK
    time, gyro = unit["ts"].ravel(), unit["vals"][5].astype(float)
    both = (time >= seen[0]) & (time <= seen[-1])
    heading = np.interp(time[both], seen, np.cumsum(turned))
    np.savez(f"set{test}.npz", t=time[both] - time[0], wz=gyro[both], heading=heading)
