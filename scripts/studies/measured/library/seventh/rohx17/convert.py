"""Messages of `imu` of a ROS bag: rate about z beside the yaw of the same sentence, by the host's stamps.

A message opens with its stamp and closes with the sentence of the unit.
"""

import struct
from pathlib import Path

from vectornav import RATES, YAW, save, sentences

#: Bytes from a message's stamp to its sentence.
STAMP = 450

bag = Path("raw/lab5/src/data/IMU_data_going_in_circles.bag").read_bytes()
rows = []
for place, told in sentences(bag):
    seconds, nanoseconds = struct.unpack_from("<II", bag, place - STAMP)
    rows.append((seconds + 1e-9 * nanoseconds, told[RATES][2], told[YAW]))
save("circles.csv", "time,gyro_z,yaw", rows)
