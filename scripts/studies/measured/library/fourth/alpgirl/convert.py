"""A phone's two gyros, the optical system's attitude in the phone's axes, and the phone at rest.

The optical clock was set to the phone's by the size of the rates, to a hundredth of a second, and the optical body's
axes were turned into the phone's by the rates too. The unit is picked up 340 s after the rest began.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

PHONE, REST = "Random_walk_2025-03-06_19-02-36.207_TGW", "Standing_still_2025-03-06_18-50-19.416_TGW"
OPTICAL = "raw/data/Mocap_simple/Random_walk_Take 2025-03-06 06.38.58 PM_004.csv"
BEGIN = 8.4  # [s] of the optical clock at the phone's first row
MOUNT = Rotation.from_matrix([[-0.5852, 0.1624, -0.7944], [0.8108, 0.1106, -0.5747], [-0.0055, -0.9805, -0.1964]])
STILL = 340.0  # [s]


def sensor(folder, name):
    """Times [s] and the three axes of one sensor; its nanoseconds are too many digits for a float."""
    lines = Path(f"raw/data/X3_simple/{folder}/{name}.csv").read_text(encoding="utf-8").splitlines()[2:]
    cells = [line.split(",") for line in lines]
    base = 1741270000 * 10**9
    return np.array([[(int(row[2]) - base) * 1e-9, *map(float, row[3:6])] for row in cells])


def write(file, names, columns):
    np.savetxt(file, columns, delimiter=",", header=names, comments="", fmt="%.12g")


first, second = sensor(PHONE, "gyroscope_uncalibrated_4"), sensor(PHONE, "second_gyroscope_uncalibrated_23")
time = first[:, 0] - first[0, 0]
beside = np.interp(first[:, 0], second[:, 0], second[:, 3])
both = (first[:, 0] >= second[0, 0]) & (first[:, 0] <= second[-1, 0])
write("two.csv", "time,gyro_z,second_z", np.column_stack((time, first[:, 3], beside))[both])

optical = np.genfromtxt(OPTICAL, delimiter=",", skip_header=7, usecols=range(1, 6))
optical = optical[np.isfinite(optical).all(axis=1)]
attitude = Rotation.from_quat(optical[:, 1:]) * MOUNT.inv()
angle = np.concatenate(([0.0], np.cumsum((attitude[:-1].inv() * attitude[1:]).as_rotvec()[:, 0])))
write(
    "walk.csv",
    "time,gyro_x,angle_x",
    np.column_stack((time, first[:, 1], np.interp(time + BEGIN, optical[:, 0], angle))),
)

gyro, accel = sensor(REST, "gyroscope_uncalibrated_4"), sensor(REST, "accelerometer_uncalibrated_2")
nearest = np.searchsorted(accel[:, 0] + 0.005, gyro[:, 0]).clip(max=len(accel) - 1)
rest = np.column_stack((gyro[:, 0] - gyro[0, 0], gyro[:, 1:], accel[nearest, 1:]))
write("rest.csv", "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z", rest[rest[:, 0] < STILL])
