"""Roll gyro of a coasting rocket (ADIS16405, counts) beside the angle of the magnetic field across the rocket.

Messages of the flight computer: four letters, six bytes of nanoseconds, two of length, the data. ADIS is twelve
numbers of sixteen bits: supply, three rates, three accelerations, three of the magnetometer, temperature, auxiliary.
"""

import struct
from pathlib import Path

import numpy as np

#: The coast: seconds since the log's first message.
FIRST, LAST = 12.4, 33.0


def adis(data):
    place = 0
    while place + 12 <= len(data):
        size = int.from_bytes(data[place + 10 : place + 12], "big")
        if data[place : place + 4] == b"ADIS" and size == 24 and place + 36 <= len(data):
            time = int.from_bytes(data[place + 4 : place + 10], "big") * 1e-9
            yield [time, *struct.unpack_from(">12h", data, place + 12)]
        place += 12 + size


rows = np.array(list(adis(Path("raw/data/LAUNCH/telemetry.log").read_bytes())))
rows = rows[(rows[:, 0] - rows[0, 0] >= FIRST) & (rows[:, 0] - rows[0, 0] < LAST)]
np.savez("coast.npz", t=rows[:, 0] - rows[0, 0], roll=rows[:, 2], field=np.arctan2(rows[:, 9], rows[:, 10]))
