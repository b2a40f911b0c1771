"""An LSM6 at rest, two seconds, logged 1666 and 6664 times a second: rows of eleven little-endian words."""

import struct
from pathlib import Path

import numpy as np

head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
for rate in (1666, 6664):
    packed = Path(f"raw/arduino/esp32logger_lsm/data/data_{rate}.bin").read_bytes()
    rows = np.array([(row[0], *row[2:8]) for row in struct.iter_unpack("<fI9f", packed)])
    np.savetxt(f"rest{rate}.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
