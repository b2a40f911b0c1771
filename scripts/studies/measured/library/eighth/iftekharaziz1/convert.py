"""Gyro z of a VN-100 beside its own yaw, which stand in the unit's line ($VNYMR), a field of the owner's tables.

Times are those at which the lines arrived.
"""

import csv

import numpy as np

for name in ("circle2_4", "circle2_5", "square2_2"):
    with open(f"raw/lab4/src/Data/{name}.csv", newline="") as file:
        rows = [(float(row["Time"]), row["VNYMR"].split("*")[0].split(",")) for row in csv.DictReader(file)]
    time = np.array([t for t, _ in rows])
    yaw, rate = np.array([(words[1], words[12]) for _, words in rows], float).T
    np.savez(f"{name}.npz", t=time - time[0], gz=rate, yaw=yaw)
