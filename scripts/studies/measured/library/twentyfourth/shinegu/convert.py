"""A unit that is carried about: gyros beside what its own attitude turned about their axes.

No times are given; at 100 rows a second the gyros turn as far as the attitude does.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

rows = np.loadtxt(Path("raw/csv") / "imu.csv", skiprows=1)
angles = body_angles(Rotation.from_quat(rows[:, [7, 8, 9, 6]]))
table = np.column_stack([0.01 * np.arange(len(rows)), rows[:, :3], angles])
header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("carried.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")
