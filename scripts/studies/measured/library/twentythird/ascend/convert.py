"""A copter's log of PX4: rates of the chosen gyros, summed between the rows of its attitude, beside what that turned.

A message of a log: length, kind, body. F tells the fields of a format, A which number has it, D is a row of it.
Source: PX4, ULog file format.
"""

import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

data, place = Path("raw/test.ulg").read_bytes(), 16
numbers, rates, attitudes = {}, [], []
while place + 3 <= len(data):
    length, kind = struct.unpack_from("<HB", data, place)
    body = data[place + 3 : place + 3 + length]
    place += 3 + length
    if kind == ord("A"):
        numbers[struct.unpack_from("<H", body, 1)[0]] = body[3:].decode(), body[0]
    elif kind == ord("D"):
        title = numbers.get(struct.unpack_from("<H", body)[0])
        if title == ("sensor_combined", 0):
            rates.append(struct.unpack_from("<Q3f", body, 2))
        elif title == ("vehicle_attitude", 0):
            attitudes.append(struct.unpack_from("<QQ4f", body, 2))
gyro, attitude = np.array(rates), np.array(attitudes)
time = attitude[:, 1] * 1e-6
turned = body_angles(Rotation.from_quat(attitude[:, [3, 4, 5, 2]]))
ends = gyro[:, 0] * 1e-6
sums = np.vstack((np.zeros(3), np.cumsum(gyro[1:, 1:] * np.diff(ends)[:, None], axis=0)))
summed = np.column_stack([np.diff(np.interp(time, ends, sums[:, k])) for k in range(3)])
table = np.column_stack((time[1:] - time[0], summed, turned[1:]))
np.savetxt("flown.csv", table, delimiter=",", header="time,gx,gy,gz,angle_x,angle_y,angle_z", comments="", fmt="%.10g")
