"""Runs of the rate table with the rate that was set, faces and rests as tables.

The rests were logged as text over a serial port that broke lines: those whose form or checksum is wrong are left out,
and each row's time is its line's number at 50 Hz.
"""

import re
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
from scipy.io import loadmat

LINE = re.compile(rb"\$VNIMU(,[+-]\d+\.\d+){11}\*[0-9A-F]{2}")
#: Lines of one attitude each, without the turns between.
RESTS = {"down": slice(5500, 17000), "up": slice(18000, 26900)}


def whole(line: bytes) -> bool:
    return bool(LINE.fullmatch(line)) and reduce(xor, line[1:-3]) == int(line[-2:], 16)


for unit, axis in ((0, "z"), (1, "x")):
    for rate in (30, 60):
        runs = loadmat(f"raw/VN200_Cal_Data/IMU{unit}/IMU{unit}_gyro{rate}_test.mat")
        for way, sign in (("up", 1), ("down", -1)):
            gyro = runs[f"{axis}_{way}_gyro"][:, "xyz".index(axis)]
            table = np.column_stack([gyro, np.full(gyro.size, sign * rate)])
            name = f"imu{unit}_{axis}_{way}_{rate}.csv"
            np.savetxt(name, table, delimiter=",", header="gyro,rate", comments="", fmt="%.7g")
faces = loadmat("raw/VN200_Cal_Data/IMU0/IMU0_accel_test.mat")
for axis in "xyz":
    for way in ("up", "down"):
        name, head = f"imu0_{axis}_{way}.csv", "accel_x,accel_y,accel_z"
        np.savetxt(name, faces[f"{axis}_{way}_accel"], delimiter=",", header=head, comments="", fmt="%.7g")
lines = Path("raw/VN200_Cal_Data/Raw_Data/static_z-_z+_IMU1.csv").read_bytes().splitlines()
for way, part in RESTS.items():
    rows = [[k / 50, *map(float, line[:-3].split(b",")[4:11])] for k, line in enumerate(lines[part]) if whole(line)]
    head = "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,temperature"
    np.savetxt(f"rest_z_{way}.csv", rows, delimiter=",", header=head, comments="", fmt="%.7g")
