"""One reading (a mean of 25) for each attitude: written four times, a second apart, with the attitude's number."""

import numpy as np

rows = np.genfromtxt("raw/examples/acceldata-example.txt")
rows = np.repeat(np.column_stack((rows, np.arange(len(rows)))), 4, axis=0)
np.savetxt("attitudes.csv", rows, fmt="%.9g", delimiter=",", header="ax,ay,az,attitude", comments="")
