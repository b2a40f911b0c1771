"""Gyro z of a model car beside the heading that its motor controller sums up of its rate of turn.

Both stand in a ROS bag, each message with its stamp; the heading is drawn straight between its rows.
"""

import bz2
import struct
from pathlib import Path

import numpy as np


def records(data):
    """The records of a ROS bag: fields of the header, and the data; chunks are opened."""
    place = 0
    while place < len(data):
        (size,) = struct.unpack_from("<I", data, place)
        head, place = data[place + 4 : place + 4 + size], place + 4 + size
        (size,) = struct.unpack_from("<I", data, place)
        body, place = data[place + 4 : place + 4 + size], place + 4 + size
        fields = {}
        while head:
            (n,) = struct.unpack_from("<I", head)
            key, _, value = head[4 : 4 + n].partition(b"=")
            fields[key], head = value, head[4 + n :]
        if fields[b"op"] == b"\x05":
            yield from records(bz2.decompress(body) if fields[b"compression"] == b"bz2" else body)
        else:
            yield fields, body


def messages(file):
    """Topic, stamp, and what follows the header of each message."""
    topics = {}
    for fields, body in records(Path(file).read_bytes().partition(b"\n")[2]):
        if fields[b"op"] == b"\x07":
            topics[fields[b"conn"]] = fields[b"topic"]
        elif fields[b"op"] == b"\x02":
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
