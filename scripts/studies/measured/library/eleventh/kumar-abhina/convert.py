"""The unit at rest out of a bag (quaternion, rates, accelerations without covariances), and moved by hand.

By hand: rates beside the angles that its own attitude ($VNYMR: yaw, pitch, roll) turned about its own axes.
"""

import csv
import struct
from pathlib import Path

import numpy as np
from ros_bag import messages
from scipy.spatial.transform import Rotation

rest = np.array(
    [(stamp, *struct.unpack_from("<10d", body)) for stamp, body in messages("raw/LAB3/Data/Abhinav.bag", b"/imu")]
)
rest[:, 0] -= rest[0, 0]
np.savetxt(
    "rest.csv", rest[:, [0, 5, 6, 7, 8, 9, 10]], fmt="%.9g", delimiter=",", header="t,gx,gy,gz,ax,ay,az", comments=""
)

rows = []
with Path("raw/LAB3/Data/imu_mov-imu.csv").open(encoding="utf-8") as lines:
    for line in csv.reader(lines):
        text = next((cell for cell in line if "$VNYMR" in cell), "")
        words = text[text.find("$VNYMR") :].partition("*")[0].split(",")[1:13]
        if len(words) == 12:
            rows.append([float(line[2]) + 1e-9 * float(line[3]), *map(float, words)])
rows = np.array(rows)
attitude = Rotation.from_euler("ZYX", rows[:, 1:4], degrees=True)
steps = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
table = np.column_stack((rows[:, 0] - rows[0, 0], rows[:, 10:13], angles))
np.savetxt("hand.csv", table, fmt="%.9f", delimiter=",", header="t,gx,gy,gz,angle_x,angle_y,angle_z", comments="")
