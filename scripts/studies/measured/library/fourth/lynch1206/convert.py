"""A phone's uncalibrated gyro z beside what the phone's own orientation turned about z."""

import numpy as np
from scipy.spatial.transform import Rotation

FOLDER = "raw/data/2022-09-16_11-15-46"
gyro = np.genfromtxt(f"{FOLDER}/GyroscopeUncalibrated.csv", delimiter=",", names=True)
own = np.genfromtxt(f"{FOLDER}/Orientation.csv", delimiter=",", names=True)
attitude = Rotation.from_quat(np.column_stack([own[q] for q in ("qx", "qy", "qz", "qw")]))
angle = np.concatenate(([0.0], np.cumsum((attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 2])))
time, when = gyro["seconds_elapsed"], own["seconds_elapsed"]
both = (time >= when[0]) & (time <= when[-1])
np.savetxt(
    "phone.csv",
    np.column_stack((time, gyro["z"], np.interp(time, when, angle)))[both],
    delimiter=",",
    header="time,gyro_z,angle_z",
    comments="",
    fmt="%.12g",
)
