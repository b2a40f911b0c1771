"""An Xsens MTi-G that is carried about and rests now and then, 6445 rows without times.

Its program unpacks six numbers and calls them roll, pitch, yaw, latitude, longitude, altitude; a dictionary has put
them in the order of the head (yaw, longitude, pitch, latitude, altitude, roll). By their size they are the calibrated
accelerations (roll, pitch, yaw: 9.8 when level) and rates (latitude, longitude, altitude) of the unit.
"""

from pathlib import Path

import numpy as np

rows = []
for line in Path("raw/IMU_data.txt").read_text(encoding="utf-8").splitlines():
    words = [word for word in line.split(",") if word.strip()]
    if len(words) == 6:
        rows.append([float(word) for word in words])
table = np.array(rows)[:, [5, 2, 0, 3, 1, 4]]
head = "acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("carried.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
np.savetxt("rest.csv", table[5960:6420], delimiter=",", header=head, comments="", fmt="%.9g")
