"""A robot that hangs as a pendulum: its gyro beside the encoder of the hinge.

Two boards log, each by its own clock [ms]. The encoder's times are moved, by whole hundredths of a second, to where the
change of its angle goes best with the gyro; its angle is then read at the gyro's times.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/datasets")
STEP = 0.01
#: Table, log of the hinge and its columns (ms, deg), log of the robot and its columns (ms, rad/s)
RUNS = (
    ("small", "2024-01-21_20-08-00", "2024-01-21_20-08-00-pendulum", (1, 2), "2024-01-21_20-07-59-mbed", (0, 1)),
    ("large", "2024-03-06-Model", "2024-03-03_16-58-05-pendulum", (0, 1), "2024-03-03_16-58-04-packet-8-mbed", (0, 4)),
    (
        "hand",
        "2024-03-12-FusionTest",
        "2024-03-11_21-51-07-pendulum",
        (1, 2),
        "2024-03-11_21-51-05-packet-8-mbed",
        (0, 4),
    ),
    ("first", "2024-01-06_19-53-00", "2024-01-06_19-53-00-pendulum", (1, 2), "2024-01-06_19-52-51-mbed", (0, 4)),
)


def columns(path: Path, wanted: tuple[int, int]) -> np.ndarray:
    """Two columns of a log, of the lines that hold numbers there; times [s] from the first, rising."""
    rows = []
    for line in path.read_text(encoding="utf-8").splitlines():
        parts = line.split(",")
        try:
            rows.append([float(parts[k]) for k in wanted])
        except (ValueError, IndexError):
            continue
    table = np.array(rows)
    table[:, 0] = (table[:, 0] - table[0, 0]) / 1e3
    return table[np.r_[True, np.diff(table[:, 0]) > 0]]


for table, folder, hinge_log, hinge_columns, robot_log, robot_columns in RUNS:
    hinge, degrees = columns(RAW / folder / f"{hinge_log}.csv", hinge_columns).T
    at, gyro = columns(RAW / folder / f"{robot_log}.csv", robot_columns).T
    angle = np.unwrap(degrees, period=360.0)
    even, own = np.arange(0, hinge[-1], STEP), np.arange(0, at[-1], STEP)
    rate = np.convolve(np.gradient(np.interp(even, hinge, angle), STEP), np.ones(9) / 9, "same")
    read = np.interp(own, at, gyro)
    n = 1 << (len(rate) + len(read)).bit_length()
    alike = np.fft.irfft(np.fft.rfft(read - read.mean(), n) * np.conj(np.fft.rfft(rate - rate.mean(), n)), n)
    best = int(np.argmax(np.abs(alike)))
    on_hinge = at - (best if best < n / 2 else best - n) * STEP
    kept = (on_hinge > hinge[0]) & (on_hinge < hinge[-1])
    rows = np.column_stack([at, gyro, np.interp(on_hinge, hinge, angle)])[kept]
    np.savetxt(f"{table}.csv", rows, delimiter=",", header="time_s,gyro_x,hinge_deg", comments="", fmt="%.9g")
