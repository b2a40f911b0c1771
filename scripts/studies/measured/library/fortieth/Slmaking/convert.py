"""A telephone in the cup holder of a car: what its gyro turns about the vertical from fix to fix, beside the course.

The vertical is the mean of the accelerometer; the gyro is summed between the times of the fixes, one a second; the
course counts clockwise, and is turned round.
"""

from pathlib import Path

import numpy as np

RAW = Path("raw/Data")
held = {
    name: np.genfromtxt(RAW / f"{name}.csv", delimiter=",", skip_header=1)
    for name in ("Accelerometer", "Gyroscope", "Location")
}
up = held["Accelerometer"][:, 1:].mean(axis=0)
gyro = held["Gyroscope"]
rate = gyro[:, 1:] @ (up / np.linalg.norm(up))
turned = np.r_[0, np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(gyro[:, 0]))]
time = held["Location"][:, 0]
course = -np.degrees(np.unwrap(np.radians(held["Location"][:, 5])))
step = np.degrees(np.diff(np.interp(time, gyro[:, 0], turned), prepend=turned[0]))
head = "time_s,course_deg,turned_deg"
np.savetxt("drive.csv", np.column_stack([time, course, step])[1:], delimiter=",", header=head, comments="", fmt="%.9g")
