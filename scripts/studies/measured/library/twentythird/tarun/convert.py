"""VN-100 in a car that drives circles: rates beside the unit's own heading, out of the unit's sentences.

Yaw counts clockwise, as the gyro about z (downwards) does.
"""

import re

import numpy as np
from ros_bag import texts

SENTENCE = re.compile(rb"\$VNYMR([^*]*)\*")
rows = []
for time, body in texts("raw/LAB4/Data/circles.bag", b"$VNYMR"):
    told = SENTENCE.search(body)
    if told:
        cells = [float(x) for x in re.findall(rb"[-+]\d+\.\d+", told.group(1))]
        rows.append((time, cells[0], *cells[6:]))
table = np.array([row for row in rows if len(row) == 8])
table[:, 0] -= table[0, 0]
table[:, 1] = np.unwrap(table[:, 1], period=360.0)
np.savetxt("circles.csv", table, delimiter=",", header="time,yaw,ax,ay,az,gx,gy,gz", comments="", fmt="%.10g")
