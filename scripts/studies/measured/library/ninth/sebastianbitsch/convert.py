"""Merged logs of the two robots.

aruco: gyro z of the box beside the heading of the wheels, which has a log of its own, drawn straight between its rows.
velctrl: gyro y and tilt of three runs of the balancing robot, whose logs differ in their columns; the gyro's sign is
put right.
"""

import numpy as np

doc, runs = "raw/regbot/doc/robobot_mission_aruco_2", "raw/regbot/matlab/log_2015_10_31"
box, wheels = (
    np.loadtxt(f"{doc}/log_{name}_20200105_133333.297.txt", comments="%") for name in ("accgyro", "odometry")
)
both = box[(box[:, 0] >= wheels[0, 0]) & (box[:, 0] <= wheels[-1, 0])]
heading = np.interp(both[:, 0], wheels[:, 0], np.unwrap(wheels[:, 3]))
np.savez("aruco.npz", t=both[:, 0] - both[0, 0], gz=both[:, 6], heading=heading)
for run, tilt in ((2, 19), (3, 19), (5, 20)):
    rows = np.loadtxt(f"{runs}/bal_velctrl_{run}.log", comments="%")
    np.savez(f"velctrl_{run}.npz", t=rows[:, 0], gy=-rows[:, 6], tilt=rows[:, tilt])
