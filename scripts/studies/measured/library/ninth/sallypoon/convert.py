"""Gyro z of a model car beside the heading that its motor controller sums up of its rate of turn.

Both stand in a ROS bag, each message with its stamp; the heading is drawn straight between its rows.
"""

import struct
from pathlib import Path

import numpy as np
from ros_bag import behind_header

from insenv.data.readers.bags import messages_of_bag

gyro, turn = [], []
for message in messages_of_bag(Path("raw/data/raw/vesc_odom/vesc_servo_gain_m10_0.bag")):
    stamp, body = behind_header(message.body)
    if message.topic == "razor/imu":  # a quaternion with its covariance, three rates
        gyro.append((stamp, struct.unpack_from("<3d", body, 13 * 8)[2]))
    elif message.topic == "/vesc/odom":  # the child's frame, three coordinates, a quaternion
        (name,) = struct.unpack_from("<I", body)
        z, w = struct.unpack_from("<7d", body, 4 + name)[5:]
        turn.append((stamp, 2 * np.arctan2(z, w)))
(time, rate), (seen, heading) = np.array(gyro).T, np.array(turn).T
both = (time >= seen[0]) & (time <= seen[-1])
np.savez("drive.npz", t=(time - time[0])[both], gz=rate[both], heading=np.interp(time, seen, np.unwrap(heading))[both])
