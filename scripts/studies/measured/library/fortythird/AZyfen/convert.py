"""Gyro z of a telephone in the hand of somebody who walks, beside its own attitude about z, 28 s at 104 Hz."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

HERE = Path("raw/data/walking/inhand-30-steps-Zyf")
gyro = np.genfromtxt(HERE / "Gyroscope.csv", delimiter=",", names=True)
told = np.genfromtxt(HERE / "Orientation.csv", delimiter=",", names=True)
attitude = Rotation.from_quat(np.column_stack([told[name] for name in ("qx", "qy", "qz", "qw")]))
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)[:, 2]
time = told["seconds_elapsed"]
rate = np.interp(time, gyro["seconds_elapsed"], gyro["z"])
table = np.column_stack([time, np.concatenate(([0.0], np.cumsum(turned))), rate])
np.savetxt("hand.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
