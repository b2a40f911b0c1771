"""A motorcycle's gyro beside the course of its positions, from where it moves off (86.6 s).

The course is that of the step from the position before to the one after.
"""

import numpy as np

FILE = "raw/02/racebox-micro-on-bike-example.csv"
METRES = 111200.0

time, latitude, longitude, gyro = np.loadtxt(FILE, delimiter=",", skiprows=1, usecols=(1, 2, 3, 12), unpack=True)
north = METRES * latitude
east = METRES * np.cos(np.radians(latitude[0])) * longitude
course = np.arctan2(east[2:] - east[:-2], north[2:] - north[:-2])
moved = time[1:-1] >= 86.6
table = np.column_stack([time[1:-1], gyro[1:-1]])[moved]
rows = np.column_stack([table, np.unwrap(course[moved])])
np.savetxt("lap.csv", rows, delimiter=",", header="time,gyro_z,course", comments="", fmt="%.15g")
