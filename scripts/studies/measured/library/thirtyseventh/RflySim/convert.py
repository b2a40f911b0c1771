"""An autopilot in ten attitudes, the log of it, and the same turned about in the hand beside its own attitude.

The logs are rows of little-endian float32 after a head of 16 bytes. The pitch rate that the attitude tells is
(d(pitch)/dt + r sin(roll)) / cos(roll), r the gyro about z; rows that stand twice are left out, and what comes after
the first 5.2 s, for there the pitch passes the vertical.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

RAW = Path("raw/code")
FIRST = 5.2  # s


def log(path: str, columns: int) -> np.ndarray:
    held = (RAW / path).read_bytes()[16:]
    size = 4 * columns
    return np.frombuffer(held[: len(held) // size * size], "<f4").reshape(-1, columns).astype(float)


def write(name: str, head: str, table: np.ndarray) -> None:
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")


write("faces", "acc_x,acc_y,acc_z", loadmat(RAW / "e3/e3.1/AccRaw.mat")["AccRaw"].T)
write("turned", "acc_x,acc_y,acc_z", log("e3/e3.1/rawdataFile/e_acc1_A.bin", 6)[:, :3])
hand = log("e4/e4.1/e4_A.bin", 9)
hand = hand[np.r_[True, np.diff(hand[:, 8]) > 0]]
time = (hand[:, 8] - hand[0, 8]) * 1e-6
roll, pitch = hand[:, 6], hand[:, 7]
rate = (np.gradient(pitch, time) + hand[:, 5] * np.sin(roll)) / np.cos(roll)
write("hand", "time_s,rate_y,gyro_y", np.column_stack([time, rate, hand[:, 4]])[time < FIRST])
