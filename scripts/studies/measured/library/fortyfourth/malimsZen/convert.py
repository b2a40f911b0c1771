"""Rates of a telephone in a pocket, walking and running, beside the attitude that it tells itself, at 50 Hz.

The rows have no time. The attitude is yaw about z, then pitch about x, then roll about y; angles are summed up from it.
"""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

NAMES = [*(f"attitude.{a}" for a in ("yaw", "pitch", "roll")), *(f"rotationRate.{a}" for a in "xyz")]
for name, folder in (("walks", "wlk_8/sub_9"), ("runs", "jog_9/sub_9")):
    with Path(f"raw/A_DeviceMotion_data/A_DeviceMotion_data/{folder}.csv").open(encoding="utf-8") as file:
        held = np.array([[float(row[key]) for key in NAMES] for row in csv.DictReader(file)])
    attitude = Rotation.from_euler("ZXY", held[:, :3])
    turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
    angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
    for axis, letter in enumerate("xyz"):
        table = np.column_stack([np.arange(len(held)) / 50.0, angles[:, axis], held[:, 3 + axis]])
        np.savetxt(
            f"{name}_{letter}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g"
        )
