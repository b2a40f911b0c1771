"""Rates of a unit on the foot beside the angles that its own attitude turned about its own axes.

Roll, pitch and yaw of the log in radians; what the attitude turned from row to row, summed up. A last row that lacks
values is left out.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

for number in (35, 38):
    rows = np.genfromtxt(Path(f"raw/data/own/SensorConnectData_{number}.csv"), delimiter=",", skip_header=1)
    rows = rows[np.isfinite(rows).all(axis=1)]
    attitude = Rotation.from_euler("ZYX", rows[:, [12, 11, 10]])
    angles = body_angles(attitude)
    np.savetxt(
        f"foot{number}.csv",
        np.column_stack((rows[:, 0], rows[:, 4:7], angles)),
        fmt="%.8f",
        delimiter=",",
        header="t,gx,gy,gz,angle_x,angle_y,angle_z",
        comments="",
    )
