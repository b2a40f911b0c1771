"""A car's VN-100 in circles (rate about z beside the yaw of the same sentence) and at rest, by the recorder's times.

The circles are a table with the sentence $VNYMR in a column of two lines; the rest is a ROS bag, where the time of a
record stands before its message and the message closes with the sentence: yaw, pitch, roll [deg], magnetic field,
accelerations [m/s^2], rates [rad/s].
"""

import csv
import re
import struct
from pathlib import Path

import numpy as np

HERE = Path("raw/LAB4/src/data")


def numbers(sentence: str) -> list[float]:
    """Numbers of a sentence without its checksum."""
    return [float(word) for word in sentence.split("*")[0].removeprefix("$VNYMR,").split(",")]


def save(path: str, names: str, rows: list[tuple[float, ...]]) -> None:
    """A table whose time is counted from its first row."""
    table = np.array(rows)
    table[:, 0] -= table[0, 0]
    np.savetxt(path, table, delimiter=",", header=names, comments="", fmt="%.15g")


with (HERE / "data_going_in_circles/imu.csv").open(newline="") as file:
    circles = [(float(row["Time"]), numbers(row["VNYMR"])) for row in csv.DictReader(file)]
save("circles.csv", "time,gyro_z,yaw", [(at, told[11], told[0]) for at, told in circles])

bag = (HERE / "stationary.bag").read_bytes()
rest = []
for found in re.finditer(rb"\$VNYMR,[^*]*", bag):
    seconds, nanoseconds = struct.unpack_from("<II", bag, bag.rfind(b"time=", 0, found.start()) + 5)
    told = numbers(found[0].decode())
    rest.append((seconds + 1e-9 * nanoseconds, *told[9:12], *told[6:9]))
save("stationary.csv", "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z", rest)
