"""Two launches of a box: the descent of the fourth, its rates beside the estimated attitude, and the rests on the pad.

The box lies at 45 degrees to the axes of the estimate about z. The angle about an axis is the sum of its part of the
rotations between rows. A rest is what the log calls state S, without its last 0.45 s: the motor burns
then.
"""

import csv

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from turned import body_angles

GYRO = tuple(f"raw_angular_rate_{axis}_deg_per_s" for axis in "xyz")
ACCEL = tuple(f"raw_acceleration_{axis}_gs" for axis in "xyz")
QUATERNION = tuple(f"est_quaternion_{axis}" for axis in "xyzw")


def numbers(launch: int, columns: tuple[str, ...], state: str = "") -> NDArray[np.float64]:
    """Columns of a launch, of one state or all."""
    with open(f"raw/launch_data/real_firm_launches/jackpot_launch_{launch}.csv", newline="") as file:
        found = [row for row in csv.DictReader(file) if row["state_letter"] == state or not state]
    return np.array([[float(row[column]) for column in columns] for row in found])


for launch in (1, 4):
    rest = numbers(launch, ("timestamp_seconds", *GYRO, *ACCEL, "temperature_celsius"), "S")
    rest = rest[rest[:, 0] < rest[-1, 0] - 0.45]
    names = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,temperature"
    np.savetxt(f"pad{launch}.csv", rest, delimiter=",", header=names, comments="", fmt="%.15g")

flight = numbers(4, ("timestamp_seconds", *GYRO, *QUATERNION))
chute = flight[flight[:, 0] >= 3393.0]
attitude = Rotation.from_quat(chute[:, 4:])
angle = body_angles(attitude)
raw_x, raw_y, raw_z = chute[:, 1:4].T
half = np.sqrt(0.5)
rows = np.column_stack([chute[:, 0] - chute[0, 0], raw_x, half * (raw_x - raw_y), half * (raw_x + raw_y), raw_z, angle])
names = "time,raw_x,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("chute.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
