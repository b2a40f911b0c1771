"""Messages of `/imu` of a ROS 2 bag (SQLite): rate about z beside the yaw of the same sentence, by its own stamp.

A message opens with its stamp and closes with the sentence $VNYMR of the unit: yaw, pitch, roll [deg], magnetic field,
accelerations, rates [rad/s].
"""

import re
import sqlite3
import struct

import numpy as np

BAG = "raw/LAB4/data/data_going_in_circles/data_going_in_circles_0.db3"
WANTED = "SELECT data FROM messages JOIN topics ON topic_id = topics.id WHERE name = '/imu' ORDER BY timestamp"

rows = []
with sqlite3.connect(BAG) as bag:
    for (message,) in bag.execute(WANTED):
        seconds, nanoseconds = struct.unpack_from("<iI", message, 4)
        sentence = re.search(rb"\$VNYMR,([^*]*)", message)
        assert sentence is not None
        numbers = [float(word) for word in sentence[1].split(b",")]
        rows.append((seconds + 1e-9 * nanoseconds, numbers[11], numbers[0]))
table = np.array(rows)
table[:, 0] -= table[0, 0]
np.savetxt("circles.csv", table, delimiter=",", header="time,gyro_z,yaw", comments="", fmt="%.15g")
