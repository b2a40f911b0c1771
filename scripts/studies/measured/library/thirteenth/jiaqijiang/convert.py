"""Packets of a WitMotion unit: time, acceleration, temperature, rates, angles; and what its attitude turned by."""

import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles


def table(log):
    rows, row, at = [], {}, 0
    while at + 11 <= len(log):
        packet = log[at : at + 11]
        if packet[0] != 0x55 or sum(packet[:10]) & 255 != packet[10]:
            at += 1
            continue
        if packet[1] == 0x50:
            row = {"t": packet[5] * 3600 + packet[6] * 60 + packet[7] + 1e-3 * struct.unpack("<H", packet[8:10])[0]}
        else:
            row[packet[1]] = struct.unpack("<4h", packet[2:10])
        if {"t", 0x51, 0x52, 0x53} <= row.keys():
            rates, angles = np.array(row[0x52][:3]) / 32768 * 2000, np.array(row[0x53][:3]) / 32768 * 180
            rows.append((row["t"], *rates, *angles, row[0x51][3] / 100))
            row = {}
        at += 11
    rows = np.array(rows)
    attitude = Rotation.from_euler("ZYX", rows[:, [6, 5, 4]], degrees=True)
    turned = body_angles(attitude)
    return np.column_stack((rows[:, 0] - rows[0, 0], rows[:, 1:4], turned, rows[:, 7]))


for number in (59, 60):
    found = table(Path(f"raw/data/WIT000{number}.TXT").read_bytes())
    names = "t,gx,gy,gz,angle_x,angle_y,angle_z,temp"
    np.savetxt(f"worn_{number}.csv", found, fmt="%.9g", delimiter=",", header=names, comments="")
