"""Messages of `imu` of a ROS bag: rate about z beside the yaw of the same sentence, by the host's stamps.

A message opens with its stamp and closes with the sentence $VNYMR of the unit: yaw, pitch, roll [deg], magnetic field,
accelerations, rates [rad/s].
"""

import re
import struct
from pathlib import Path

import numpy as np

#: Bytes from a message's stamp to its sentence.
STAMP = 450

bag = Path("raw/lab5/src/data/IMU_data_going_in_circles.bag").read_bytes()
rows = []
for found in re.finditer(rb"\$VNYMR,([-+.,0-9]*)", bag):
    seconds, nanoseconds = struct.unpack_from("<II", bag, found.start() - STAMP)
    numbers = [float(word) for word in found[1].split(b",")]
    rows.append((seconds + 1e-9 * nanoseconds, numbers[11], numbers[0]))
table = np.array(rows)
table[:, 0] -= table[0, 0]
np.savetxt("circles.csv", table, delimiter=",", header="time,gyro_z,yaw", comments="", fmt="%.15g")
