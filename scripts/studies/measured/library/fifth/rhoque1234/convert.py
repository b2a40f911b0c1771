"""A VN-100's rate about z beside the yaw of its orientation, by the host's stamps.

Each second line of the file is blank, and it names no columns: seconds and nanoseconds, the quaternion (x first) from
the seventh, rates from the twentieth.
"""

import numpy as np
from scipy.spatial.transform import Rotation

with open("raw/RSN_lab5_data/data/imugoing_in_circles1.csv") as file:
    cells = [line.split(",") for line in file if line.strip()]
numbers = np.array([[float(cell[k]) for k in (0, 1, 6, 7, 8, 9, 21)] for cell in cells])
time = numbers[:, 0] - numbers[0, 0] + 1e-9 * numbers[:, 1]
yaw = np.unwrap(Rotation.from_quat(numbers[:, 2:6]).as_euler("ZYX")[:, 0])
table = np.column_stack([time - time[0], numbers[:, 6], yaw])
np.savetxt("circles.csv", table, delimiter=",", header="time,gyro_z,yaw", comments="", fmt="%.15g")
