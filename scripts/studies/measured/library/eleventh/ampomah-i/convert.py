"""Rows of the records $VNYMR (yaw, pitch, roll, field, acceleration, rates).

Of the car in circles with the stamps beside them, of the car at rest out of the messages' own text.
"""

from pathlib import Path

from ros_bag import messages
from vectornav import NAMES, of_a_table, save, sentences

save("circle.csv", NAMES, of_a_table(Path("raw/LAB4/Analysis/data_going_in_circles/imu.csv")), digits=9)
rest = [(stamp, *row) for stamp, body in messages("raw/LAB4/Data/stationary.bag", "/imu") for _, row in sentences(body)]
save("rest.csv", NAMES, rest, digits=9)
