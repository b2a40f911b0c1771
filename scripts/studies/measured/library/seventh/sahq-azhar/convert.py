"""A car's VN-100 in circles (rate about z beside the yaw of the same sentence) and at rest, by the recorder's times.

The circles are a table with the sentence in a column of two lines; the rest is a ROS bag, where the time of a record
stands before its message and the message closes with the sentence.
"""

import csv
import struct
from pathlib import Path

from vectornav import ACCELERATIONS, RATES, YAW, save, sentence, sentences

HERE = Path("raw/LAB4/src/data")

with (HERE / "data_going_in_circles/imu.csv").open(newline="") as file:
    circles = [(float(row["Time"]), sentence(row["VNYMR"].encode())) for row in csv.DictReader(file)]
save("circles.csv", "time,gyro_z,yaw", [(at, told[RATES][2], told[YAW]) for at, told in circles])

bag = (HERE / "stationary.bag").read_bytes()
rest = []
for place, told in sentences(bag):
    seconds, nanoseconds = struct.unpack_from("<II", bag, bag.rfind(b"time=", 0, place) + 5)
    rest.append((seconds + 1e-9 * nanoseconds, *told[RATES], *told[ACCELERATIONS]))
save("stationary.csv", "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z", rest)
