"""A second each: the course from one position to the next, and the gyro's mean since the course before."""

import numpy as np
from scipy.io import loadmat

data = loadmat("raw/data/imugps.mat")
unit, receiver = data["yimu_struct"][0, 0], data["ygps_struct"][0, 0]
t, rate = unit["t"][:, 0], unit["y"][:, 5]
step = np.diff(receiver["y"], axis=0)
when = receiver["t"][:-1, 0] + 0.5
inside = (when >= t[0]) & (when <= t[-1])
when, course = when[inside], np.unwrap(np.arctan2(step[:, 1], step[:, 0]))[inside]
turned = np.interp(when, t, np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))]))
table = np.column_stack([when[1:], np.diff(turned), course[1:]])
np.savetxt("course.csv", table, delimiter=",", header="time,gyro_z,course", comments="", fmt="%.9g")
