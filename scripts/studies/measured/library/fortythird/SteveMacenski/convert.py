"""A quadrotor on a stand that is moved by hand in front of motion capture, 108 s at some 40 Hz.

The angles of the motion capture are those of the world as the body sees it, and its body lies 131.3 degrees about z
beside that of the gyros.
"""

import re
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

text = Path("raw/Lab 1/Sensor Work/20150904-154847.txt").read_text(encoding="utf-8", errors="replace")
told = [re.findall(r"-?\d*\.\d+", line) for line in text.splitlines()]
held = np.array([list(map(float, row)) for row in told if len(row) == 13])
held = held[np.concatenate(([True], np.diff(held[:, 0]) > 0))]
attitude = Rotation.from_euler("XYZ", held[:, 10:13]).inv()
turned = -(attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)
angles = np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
beside = np.deg2rad(131.3)
about_x = np.cos(beside) * angles[:, 0] + np.sin(beside) * angles[:, 1]
for name, angle, gyro in (("about_x", about_x, held[:, 4]), ("about_z", angles[:, 2], held[:, 6])):
    table = np.column_stack([held[:, 0], angle, gyro])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")
