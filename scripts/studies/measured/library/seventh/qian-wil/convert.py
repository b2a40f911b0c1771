"""Messages of `/imu` of a ROS 2 bag (SQLite): rates beside the angles of the unit's attitude, by the recorder's stamps.

A message closes with the sentence $VNYMR of the unit: yaw, pitch, roll [deg], magnetic field, accelerations, rates
[rad/s]. The angle about a body axis is the sum of its part of the rotations between rows.
"""

import re
import sqlite3

import numpy as np
from scipy.spatial.transform import Rotation

BAG = "raw/LAB4/data/data_going_in_circles2/data_going_in_circles2.db3"
WANTED = (
    "SELECT timestamp, data FROM messages JOIN topics ON topic_id = topics.id WHERE name = '/imu' ORDER BY timestamp"
)

stamps, sentences = [], []
with sqlite3.connect(BAG) as bag:
    for stamp, message in bag.execute(WANTED):
        sentence = re.search(rb"\$VNYMR,([^*]*)", message)
        assert sentence is not None
        stamps.append(stamp)
        sentences.append([float(word) for word in sentence[1].split(b",")])
told = np.array(sentences)
attitude = Rotation.from_euler("ZYX", told[:, :3], degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
angle = np.vstack([np.zeros(3), np.cumsum(turned, axis=0)])
time = 1e-9 * (np.array(stamps) - stamps[0])
names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
rows = np.column_stack([time, told[:, 9:12], angle])
np.savetxt("circles.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
