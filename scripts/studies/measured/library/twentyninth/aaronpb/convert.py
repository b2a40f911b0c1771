"""Units on a person who stands and bends on force plates: the turn of each in its own quaternions, at its gyro's rows.

The rate is over two rows, from the one before to the one after.
"""

import numpy as np

rows = np.genfromtxt("raw/tests/files/full_dataset_RAW.csv", delimiter=",", names=True)
time = (rows["timestamp"] - rows["timestamp"][0]) / 1000


def body_rates(quaternions):
    """Rates about the body's axes from (w, x, y, z), without the first and the last row."""
    a, b = quaternions[:-2], quaternions[2:]
    w = (a * b).sum(1)
    v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    length = np.linalg.norm(v, axis=1)
    turned = 2 * np.arctan2(length, np.abs(w)) * np.sign(w)
    return v / (length + 1e-15)[:, None] * (turned / (time[2:] - time[:-2]))[:, None]


for unit, name in (("Thigh_Right", "thigh"), ("UpperTrunk_Right", "trunk")):
    turn = body_rates(np.column_stack([rows[f"IMU_{unit}_q{k}"] for k in "wxyz"]))
    gyro = np.column_stack([rows[f"IMU_{unit}_w{k}"] for k in "xyz"])[1:-1]
    head = "time_s,turn_x,turn_y,turn_z,gyro_x,gyro_y,gyro_z"
    table = np.column_stack([time[1:-1], turn, gyro])
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
