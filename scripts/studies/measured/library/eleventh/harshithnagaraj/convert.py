"""Rows of the records $VNYMR (yaw, pitch, roll, field, acceleration, rates) with the stamps beside them."""

import csv
from pathlib import Path

import numpy as np

(log,) = Path("raw/lab5/src/data").glob("*imu.csv")
rows = []
with log.open(encoding="utf-8") as lines:
    for line in csv.reader(lines):
        text = next((cell for cell in line if "$VNYMR" in cell), "")
        words = text[text.find("$VNYMR") :].partition("*")[0].split(",")[1:13]
        if len(words) == 12:
            rows.append([float(line[2]) + 1e-9 * float(line[3]), *map(float, words)])
rows = np.array(rows)
rows[:, 0] -= rows[0, 0]
names = "t,yaw,pitch,roll,mx,my,mz,ax,ay,az,gx,gy,gz"
np.savetxt("car.csv", rows, fmt="%.9g", delimiter=",", header=names, comments="")
