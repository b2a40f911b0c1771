"""Accelerometer of a small submarine in thousandths of g, ten rows a second: level for 37 s, and on two faces.

Records of 256 bytes, of which the first 48 are nine floats and three integers.
"""

import struct
from pathlib import Path

import numpy as np


def read(number: int) -> np.ndarray:
    packed = Path(f"raw/E80_Lab_01/Lab_data/log0{number}.bin").read_bytes()
    return np.array([struct.unpack_from("<9f3i", packed, at) for at in range(0, len(packed) - 255, 256)])


held = read(15)
table = np.column_stack([np.arange(len(held)) / 10, held[:, 3:6]])
np.savetxt("level.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
