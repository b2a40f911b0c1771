"""Messages of `/imu` (imu_driver/Vectornav) of a ROS bag as a table: insenv reads no bags.

Time stamps of the headers, rates [rad/s], accelerations [m/s^2].
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import CONNECTION, MESSAGE, records

BAG = Path("raw/LAB3/src/Data/nitin.bag")
OUT = "nitin.csv"


def row(body: bytes) -> list[float]:
    """Stamp, rates and accelerations of a message: header, quaternion of four, then vectors of three."""
    _, seconds, nanoseconds, size = struct.unpack_from("<IIII", body)
    numbers = struct.unpack_from("<10d", body, 16 + size)
    return [seconds + 1e-9 * nanoseconds, *numbers[4:10]]


found = list(records(BAG))
topics = {head[b"conn"]: head[b"topic"] for head, _ in found if head[b"op"] == CONNECTION}
rows = np.array([row(body) for head, body in found if head[b"op"] == MESSAGE and topics[head[b"conn"]] == b"/imu"])
rows[:, 0] -= rows[0, 0]
names = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
np.savetxt(OUT, rows, delimiter=",", header=names, comments="", fmt="%.9g")
