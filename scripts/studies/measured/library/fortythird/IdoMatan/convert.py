"""Telephones at 100 Hz: gyro y of one in a trouser pocket beside its own attitude, and rests of another on three faces.

The telephone tells gravity and what is left of the force without it; their sum is the force. The gyro of the walk comes
at 500 Hz and is read at the times of the attitude.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

WALK, REST = Path("raw/data/walking/inpocket-27-steps-Matan"), Path("raw/data/calibration")


def read(file: Path, names: str) -> tuple[np.ndarray, np.ndarray]:
    head = file.open(encoding="utf-8").readline().strip().split(",")
    held = np.loadtxt(file, delimiter=",", skiprows=1)
    time = np.loadtxt(file, delimiter=",", skiprows=1, usecols=0, dtype=np.int64)
    return (time - time[0]) * 1e-9 + (time[0] % 10**15) * 1e-9, held[:, [head.index(n) for n in names.split()]]


told, quaternion = read(WALK / "Orientation.csv", "qx qy qz qw")
time, gyro = read(WALK / "Gyroscope.csv", "y")
attitude = Rotation.from_quat(quaternion)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)[:, 1]
angle = np.concatenate(([0.0], np.cumsum(turned)))
keep = (told > time[0]) & (told < time[-1])
table = np.column_stack([told - told[0], angle, np.interp(told, time, gyro[:, 0])])[keep]
np.savetxt("pocket.csv", table, delimiter=",", header="time_s,angle_deg,gyro", comments="", fmt="%.9g")

time, gyro = read(REST / "x-calibration/Gyroscope.csv", "x y z")
table = np.column_stack([time - time[0], gyro])
np.savetxt("lies.csv", table, delimiter=",", header="time_s,gyro_x,gyro_y,gyro_z", comments="", fmt="%.9g")
for axis in "xyz":
    time, rest = read(REST / f"{axis}-calibration/Accelerometer.csv", "x y z")
    force = rest + read(REST / f"{axis}-calibration/Gravity.csv", "x y z")[1]
    table = np.column_stack([time - time[0], force])[: int(0.8 * len(time))]
    np.savetxt(f"face_{axis}.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
