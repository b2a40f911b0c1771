"""Gyro z of a small aeroplane beside the course of its GNSS velocity, drawn straight between its 10 Hz readings.

The receiver's log repeats each reading at the gyro's rows until the next one: the first row of each is taken. The
beginning and the end of the log are left out.
"""

import numpy as np

FIRST, LAST = 20.0, 375.0

unit, receiver = (np.loadtxt(f"raw/{name}.txt", delimiter=",") for name in ("imu", "gps"))
new = np.concatenate(([True], np.any(np.diff(receiver[:, 4:6], axis=0) != 0, axis=1)))
course = np.unwrap(np.arctan2(receiver[new, 5], receiver[new, 4]))
time = unit[:, 0] - unit[0, 0]
flown = (time >= FIRST) & (time <= LAST)
np.savez(
    "flight.npz",
    t=time[flown],
    gz=unit[flown, 3],
    course=np.interp(unit[flown, 0], receiver[new, 0], course),
)
