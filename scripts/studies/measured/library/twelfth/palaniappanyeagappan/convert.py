"""A car's gyro about the vertical beside the course between its GNSS fixes, on the gyro's rows.

The driver filled in no rates, but its messages end with the line that the unit sent. The course from one fix to the
next is that of the middle between them, drawn straight from one to the next; the receiver counts the seconds of the
day. Rows slower than 1 m/s have no course.
"""

import struct
from collections.abc import Iterator

import numpy as np
from ros_bag import messages
from vectornav import RATES, sentences

BAG = "raw/lab5/src/data/data_going_in_circles.bag"


def rates() -> Iterator[tuple[float, float]]:
    """Stamps [s] and rates about z [rad/s]."""
    for stamp, body in messages(BAG, "/imu"):
        *_, (_, numbers) = sentences(body)
        if len(numbers) == 12:
            yield stamp % 86400.0, numbers[RATES][2]


fixes = np.array([(stamp, *struct.unpack_from("<5d", body)[3:5]) for stamp, body in messages(BAG, "/gps")])
steps = np.diff(fixes, axis=0)
middle, speed = (fixes[1:, 0] + fixes[:-1, 0]) / 2, np.hypot(steps[:, 1], steps[:, 2]) / steps[:, 0]
moving = speed > 1.0
course = np.unwrap(np.arctan2(steps[moving, 1], steps[moving, 2]))  # clockwise from north, as z of the unit points down
unit = np.array(list(rates()))
fast = np.interp(unit[:, 0], middle, speed, left=0.0, right=0.0) > 1.0
unit = unit[fast]
np.savez("circles.npz", t=unit[:, 0] - unit[0, 0], wz=unit[:, 1], course=np.interp(unit[:, 0], middle[moving], course))
