"""A wheelchair's gyros, on the times of the frame's: the frame's about the vertical, and those about the axles.

Each unit has its own rows at 400 Hz of one clock; what the wheels read is put on the frame's times by straight lines.
"""

import numpy as np

RAW = "raw/docs/chapters/examples/example_data/imu_example_data"
UNITS = ("NGIMU - 1 Frame - 00337909", "NGIMU - 5 Left - 00338C0E", "NGIMU - 3 Right - 003383F9")

frame, left, right = (
    np.genfromtxt(f"{RAW}/{unit}/sensors.csv", delimiter=",", skip_header=1, usecols=range(4)) for unit in UNITS
)
last = min(unit[-1, 0] for unit in (frame, left, right))
time = frame[(frame[:, 0] >= 0.1) & (frame[:, 0] <= last), 0]
about = [np.interp(time, unit[:, 0], unit[:, axis]) for unit, axis in ((frame, 3), (left, 2), (right, 2))]
np.savetxt(
    "chair.csv",
    np.column_stack((time, *about, about[2] - about[1])),
    fmt="%.6f",
    delimiter=",",
    header="time,frame,left,right,difference",
    comments="",
)
