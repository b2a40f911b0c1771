"""Messages of `/imu` of a ROS 2 bag (SQLite): rate about z beside the yaw of the same sentence, by its own stamp.

A message opens with its stamp and closes with the sentence of the unit.
"""

import struct

from vectornav import RATES, YAW, messages, save, sentence

rows = []
for _, message in messages("raw/LAB4/data/data_going_in_circles/data_going_in_circles_0.db3", "/imu"):
    seconds, nanoseconds = struct.unpack_from("<iI", message, 4)
    told = sentence(message)
    rows.append((seconds + 1e-9 * nanoseconds, told[RATES][2], told[YAW]))
save("circles.csv", "time,gyro_z,yaw", rows)
