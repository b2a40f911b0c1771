"""Gyro z of the VN-100 in a car beside its own yaw, out of the line ($VNYMR) in the messages of a ROS 2 bag (SQLite).

Times are those of the messages' headers.
"""

import sqlite3
import struct

import numpy as np

with sqlite3.connect("file:raw/LAB4/data/data_circle2/data_circle2_0.db3?mode=ro", uri=True) as bag:
    bodies = [
        body
        for (body,) in bag.execute(
            "select data from messages where topic_id = (select id from topics where name = '/imu') order by timestamp"
        )
    ]
stamps = [struct.unpack_from("<iI", body, 4) for body in bodies]
words = np.array([body[body.find(b"$VNYMR") :].split(b"*")[0].split(b",")[1:] for body in bodies], float)
time = np.array([seconds - stamps[0][0] + nanoseconds * 1e-9 for seconds, nanoseconds in stamps])
np.savez("circles.npz", t=time - time[0], gz=words[:, 11], yaw=words[:, 0])
