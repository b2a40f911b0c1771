"""Means of an accelerometer in twelve positions, from MATLAB files whose compressed variables carry wrong checksums."""

import struct
import zlib
from pathlib import Path

import numpy as np


def element(data: bytes, at: int) -> tuple[bytes, int]:
    """A data element of a MATLAB 5 file: its bytes, and where the next one begins."""
    kind, size = struct.unpack_from("<II", data, at)
    if kind >> 16:
        return data[at + 4 : at + 4 + (kind >> 16)], at + 8
    return data[at + 8 : at + 8 + size], at + 8 + size + (-size % 8)


def variables(path: Path) -> dict[str, np.ndarray]:
    """The single-precision variables of a file by their names."""
    data = path.read_bytes()
    found, at = {}, 128
    while at < len(data) - 8:
        size = struct.unpack_from("<I", data, at + 4)[0]
        matrix = zlib.decompressobj(-15).decompress(data[at + 10 : at + 8 + size])
        _, next_ = element(matrix, 8)
        _, next_ = element(matrix, next_)
        name, next_ = element(matrix, next_)
        values, _ = element(matrix, next_)
        found[name.decode()] = np.frombuffer(values, "<f4").astype(float)
        at += 8 + size
    return found


means = []
for number in range(1, 13):
    held = variables(Path(f"raw/fix_acc_01_{number}.mat"))
    means.append([held[f"Respiratory_Sensor_Port_COM3_Canal_{axis}_g_Amplitude"].mean() for axis in range(3)])
np.savetxt("positions.csv", means, delimiter=",", header="accel_x,accel_y,accel_z", comments="", fmt="%.7f")
