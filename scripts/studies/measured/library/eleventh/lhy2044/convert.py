"""Rows of the records $VNYMR out of the text that the bag's messages carry: stamp, acceleration, rates."""

import re

import numpy as np
from ros_bag import messages

rows = []
for stamp, body in messages("raw/imu/data/imu.bag", "imu/"):
    text = re.search(rb"\$VNYMR((?:,[-+0-9.]+){12})", body)
    if text:
        rows.append([stamp, *map(float, text.group(1).decode().split(",")[7:13])])
rows = np.array(rows)
rows[:, 0] -= rows[0, 0]
np.savetxt("rest.csv", rows, fmt="%.9g", delimiter=",", header="t,ax,ay,az,gx,gy,gz", comments="")
