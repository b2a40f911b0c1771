"""Gyro z of a model car beside the heading that its motor controller sums up of its rate of turn.

Both stand in a ROS bag, each message with its stamp; the heading is drawn straight between its rows.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import CONNECTION, MESSAGE, records


def messages(file):
    """Topic, stamp, and what follows the header of each message."""
    topics = {}
    for fields, body in records(Path(file)):
        if fields[b"op"] == CONNECTION:
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == MESSAGE:
            seconds, nanoseconds, name = struct.unpack_from("<3I", body, 4)
            yield topics[fields[b"conn"]], seconds + nanoseconds * 1e-9, body[16 + name :]


gyro, turn = [], []
for topic, stamp, body in messages("raw/data/raw/vesc_odom/vesc_servo_gain_m10_0.bag"):
    if topic == b"razor/imu":  # a quaternion with its covariance, three rates
        gyro.append((stamp, struct.unpack_from("<3d", body, 13 * 8)[2]))
    elif topic == b"/vesc/odom":  # the child's frame, three coordinates, a quaternion
        (name,) = struct.unpack_from("<I", body)
        z, w = struct.unpack_from("<7d", body, 4 + name)[5:]
        turn.append((stamp, 2 * np.arctan2(z, w)))
(time, rate), (seen, heading) = np.array(gyro).T, np.array(turn).T
both = (time >= seen[0]) & (time <= seen[-1])
np.savez("drive.npz", t=(time - time[0])[both], gz=rate[both], heading=np.interp(time, seen, np.unwrap(heading))[both])
