"""A box with two units, and a third on a centrifuge before it turns.

Of the box the clean rows of each, between times of their own: the autopilot's gyros in rad/s as the owner scales them,
those of the second unit at 2.2e-4 rad/s a count, which is taken from the recording itself, with the signs of the first.
"""

import re
from pathlib import Path

import numpy as np

COUNT, START, END = 2.2e-4, 60.0, 180.0


def later(times: np.ndarray) -> np.ndarray:
    """Rows whose time follows the last good one within 5 s."""
    kept, last, reach = [], 0.0, 400.0
    for row, time in enumerate(times):
        if last < time < last + reach:
            kept.append(row)
            last, reach = time, 5.0
    return np.array(kept)


found = [re.findall(r"-?\d+", line) for line in Path("raw/p_test_2_4.txt").read_text(encoding="utf-8").splitlines()[2:]]
first = np.array([[float(cell) for cell in row] for row in found if len(row) == 17])
times = first[:, 15] + 1e-9 * first[:, 16]
keep = later(times)
keep = keep[np.concatenate(([True], np.diff(first[keep, 3]) != 0.0))]
times, gyros = times[keep], first[keep, :3] * 2.0 * np.pi / 20300.0
lines = Path("raw/x_test_2_4.txt").read_text(encoding="utf-8").splitlines()[2:]
second = np.array([[float(cell) for cell in line.split()[:24]] for line in lines if len(line.split()) >= 24])
clock = 1e-3 * second[:, 23]
keep = later(clock)
others = COUNT * (second[keep, 3:6] - 32768.0) * (-1.0, 1.0, -1.0)
inside = (times >= START) & (times < END)
beside = np.column_stack([np.interp(times[inside], clock[keep], others[:, k]) for k in range(3)])
header = "time,px4_x,px4_y,px4_z,mti_x,mti_y,mti_z"
table = np.column_stack([times[inside] - START, gyros[inside], beside])
np.savetxt("box.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")

ROWS, RATE = 4480, 32.0
unit = np.loadtxt("raw/centrifuge_test/00001_CalInertialAndMag.csv", delimiter=",", skiprows=1)[:ROWS, 1:7]
warmth = np.loadtxt("raw/centrifuge_test/00001_CalBattAndTherm.csv", delimiter=",", skiprows=1)[:ROWS, 2]
table = np.column_stack([np.arange(ROWS) / RATE, unit, warmth])
header = "time,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,temperature"
np.savetxt("warming.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
