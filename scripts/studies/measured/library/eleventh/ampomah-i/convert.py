"""Rows of the records $VNYMR (yaw, pitch, roll, field, acceleration, rates).

Of the car in circles with the stamps beside them, of the car at rest out of the messages' own text.
"""

import csv
import re
from pathlib import Path

import numpy as np
from ros_bag import messages

NAMES = "t,yaw,pitch,roll,mx,my,mz,ax,ay,az,gx,gy,gz"


def write(name, rows):
    rows = np.array(rows)
    rows[:, 0] -= rows[0, 0]
    np.savetxt(f"{name}.csv", rows, fmt="%.9g", delimiter=",", header=NAMES, comments="")


circle = []
with Path("raw/LAB4/Analysis/data_going_in_circles/imu.csv").open(encoding="utf-8") as lines:
    for line in csv.reader(lines):
        text = next((cell for cell in line if "$VNYMR" in cell), "")
        words = text[text.find("$VNYMR") :].partition("*")[0].split(",")[1:13]
        if len(words) == 12:
            circle.append([float(line[2]) + 1e-9 * float(line[3]), *map(float, words)])
write("circle", circle)
rest = []
for stamp, body in messages("raw/LAB4/Data/stationary.bag", b"/imu"):
    text = re.search(rb"\$VNYMR((?:,[-+0-9.]+){12})", body)
    if text:
        rest.append([stamp, *map(float, text.group(1).decode().split(",")[1:])])
write("rest", rest)
