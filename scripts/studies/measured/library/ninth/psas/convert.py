"""Messages of the inertial unit (ADIS16405) out of the flight computer's binary logs: counts, and degC.

A message: four letters, six bytes of nanoseconds, two of length, the data. ADIS is twelve numbers of sixteen bits:
supply, three rates, three accelerations, three of the magnetometer, temperature, auxiliary.
"""

import struct
from pathlib import Path

import numpy as np


def adis(data):
    place = 0
    while place + 12 <= len(data):
        name, size = data[place : place + 4], int.from_bytes(data[place + 10 : place + 12], "big")
        body = data[place + 12 : place + 12 + size]
        if name == b"ADIS" and len(body) == 24:
            numbers = struct.unpack(">12h", body)
            yield [int.from_bytes(data[place + 4 : place + 10], "big") * 1e-9, *numbers[1:7], 25.0 + 0.14 * numbers[10]]
        place += 12 + size


for day, name in (("2014-05-09-baseline-0", "may09"), ("2014-05-13-baseline-1", "may13")):
    rows = np.array(list(adis(Path(f"raw/droptest/{day}/logfile-000").read_bytes())))
    fmt = ["%.9f"] + ["%d"] * 6 + ["%.2f"]
    np.savetxt(f"{name}.csv", rows, fmt=fmt, delimiter=",", header="t,gx,gy,gz,ax,ay,az,temperature", comments="")
