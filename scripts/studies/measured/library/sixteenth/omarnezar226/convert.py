"""Minutes of an accelerometer on a fan, one for each arrangement of weights and each speed; 50 rows a second."""

import numpy as np

log = np.loadtxt("raw/accelerometer.csv", delimiter=",", skiprows=1)
for weights, speed in ((1, 20), (1, 50), (2, 75), (3, 100)):
    rows = log[(log[:, 0] == weights) & (log[:, 1] == speed), 2:]
    np.savetxt(f"w{weights}_{speed}.csv", rows, delimiter=",", header="x,y,z", comments="", fmt="%.6g")
