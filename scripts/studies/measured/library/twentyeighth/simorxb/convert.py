"""Two stretches of a telephone turned about its level x axis: the gyro, and the angle that its accelerometers give."""

import numpy as np

# Columns: time, seconds_elapsed, z, y, x; the accelerometers are in g and point downwards at rest.
gyro = np.loadtxt("raw/GyroscopeUncalibrated.csv", delimiter=",", skiprows=1, usecols=(1, 4))
force = np.loadtxt("raw/AccelerometerUncalibrated.csv", delimiter=",", skiprows=1, usecols=(1, 3, 2))
angle = np.interp(gyro[:, 0], force[:, 0], np.unwrap(np.arctan2(-force[:, 1], -force[:, 2])))
for name, start, end in (("first", 18.0, 22.3), ("second", 24.0, 27.2)):
    kept = (gyro[:, 0] >= start) & (gyro[:, 0] <= end)
    table = np.column_stack([gyro[kept], angle[kept]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro_x,angle", comments="", fmt="%.9g")
