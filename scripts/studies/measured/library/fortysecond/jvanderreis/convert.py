"""Accelerometer of a small submarine in thousandths of g, ten rows a second: three faces, and a run in a tank.

Records of 256 bytes, of which the first 48 are nine floats and three integers.
"""

import struct
from pathlib import Path

import numpy as np


def read(number: int) -> np.ndarray:
    packed = Path(f"raw/E80_Lab_01/log00{number}.bin").read_bytes()
    return np.array([struct.unpack_from("<9f3i", packed, at) for at in range(0, len(packed) - 255, 256)])


rows = [np.column_stack([np.full(len(held), face), held[:, 3:6]]) for face, held in enumerate(map(read, (5, 6, 7)))]
table = np.column_stack([np.arange(sum(map(len, rows))) / 10, np.vstack(rows)])
np.savetxt("faces.csv", table, delimiter=",", header="time_s,face,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
held = read(3)
table = np.column_stack([np.arange(len(held)) / 10, held[:, 3:6]])
np.savetxt("tank.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
