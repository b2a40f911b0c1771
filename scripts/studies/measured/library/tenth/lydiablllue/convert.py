"""A telephone's rates without its own correction beside the angles that its own attitude turned about its own axes.

Two logs of one clock, whose rows lie 2.5 ms apart: the angles are read at the rates' times between their rows.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

raw = Path("raw/imu_data/2.2-2023-11-14_00-05-50")
gyro = np.genfromtxt(raw / "GyroscopeUncalibrated.csv", delimiter=",", names=True)
turn = np.genfromtxt(raw / "Orientation.csv", delimiter=",", names=True)
attitude = Rotation.from_quat(np.column_stack([turn[name] for name in ("qx", "qy", "qz", "qw")]))
angles = body_angles(attitude)
time = turn["seconds_elapsed"]
gyro = gyro[(gyro["seconds_elapsed"] >= time[0]) & (gyro["seconds_elapsed"] <= time[-1])]
at = [np.interp(gyro["seconds_elapsed"], time, angle) for angle in angles.T]
np.savetxt(
    "phone.csv",
    np.column_stack((gyro["seconds_elapsed"], gyro["x"], gyro["y"], gyro["z"], *at)),
    fmt="%.8f",
    delimiter=",",
    header="t,gx,gy,gz,angle_x,angle_y,angle_z",
    comments="",
)
