"""Accelerometer of a small submarine in thousandths of g that lies for four minutes, ten rows a second.

Records of 256 bytes, of which the first 48 are nine floats and three integers.
"""

import struct
from pathlib import Path

import numpy as np

packed = Path("raw/MATLAB/Lab 1/log003.bin").read_bytes()
held = np.array([struct.unpack_from("<9f3i", packed, at) for at in range(0, len(packed) - 255, 256)])
table = np.column_stack([np.arange(len(held)) / 10, held[:, 3:6]])
np.savetxt("lies.csv", table, delimiter=",", header="time_s,acc_x,acc_y,acc_z", comments="", fmt="%.9g")
