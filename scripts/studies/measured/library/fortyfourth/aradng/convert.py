"""Gyro z of a telephone in the hand of somebody who walks beside the cameras of a laboratory, at 100 Hz, two walks.

The lines of both files belong together. The angle is summed up from the attitude that the cameras tell; in the first
part of each walk they lose the telephone often.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

raw = Path("raw/nn/handheld/data1/syn")
for number, name, start in ((4, "fourth", 12000), (7, "seventh", 0)):
    unit = np.loadtxt(raw / f"imu{number}.csv", delimiter=",")
    seen = np.loadtxt(raw / f"vi{number}.csv", delimiter=",")
    size = min(len(unit), len(seen))
    attitude = Rotation.from_quat(seen[start:size, 5:9])
    turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)[:, 2]
    angle = np.concatenate(([0.0], np.cumsum(turned)))
    table = np.column_stack([np.arange(size - start) / 100.0, angle, unit[start:size, 6]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
