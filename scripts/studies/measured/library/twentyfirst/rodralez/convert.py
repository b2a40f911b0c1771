"""Gyros of two simulated units of a navigation toolbox beside the angles of its reference about their axes."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation
from turned import body_angles

HERE = Path("raw/examples/synthetic-data")
reference = loadmat(HERE / "ref.mat", squeeze_me=True)["ref"]
euler = np.column_stack([reference[name].item() for name in ("yaw", "pitch", "roll")])
angle = body_angles(Rotation.from_euler("ZYX", euler))
for unit in (1, 2):
    imu = loadmat(HERE / f"imu{unit}.mat", squeeze_me=True)[f"imu{unit}"]
    rows = np.column_stack([reference["t"].item(), imu["wb"].item(), angle])[:40000]
    header = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
    np.savetxt(f"unit{unit}.csv", rows, delimiter=",", header=header, comments="", fmt="%.10g")
