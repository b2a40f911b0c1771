"""A nine-axis unit turned by hand: gyros beside what its own attitude turned about their axes, 100 rows a second.

Of its angles the second is the roll and the first the pitch; the last line of a file may be cut short.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for name, file in (("first", "IMU.txt"), ("second", "IMU_2.txt")):
    lines = (Path("raw") / file).read_text().splitlines()[1:]
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines if line.count(",") == 11])
    angles = body_angles(Rotation.from_euler("ZYX", rows[:, [8, 6, 7]]))
    table = np.column_stack([0.01 * np.arange(len(rows)), rows[:, 3:6], angles])
    header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
