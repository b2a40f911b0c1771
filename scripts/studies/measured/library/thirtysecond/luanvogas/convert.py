"""Gyro and servo of each test in one table: a file holds rows of the gyro, a row of 1234, and the rows of the servo.

The servo's angle is taken at the times of the gyro; where its counter of turns starts anew (by 5760 deg) it goes on.
"""

from pathlib import Path

import numpy as np

folder = Path("raw/Codes/PC/MATLAB/Validation_Gyrometer_Calibration/Experimental_Data")
for test in range(1, 9):
    rows = np.genfromtxt(folder / f"gyroscope_calibration_data_Test_{test}.csv", delimiter=",")
    mark = np.flatnonzero(rows[:, 0] == 1234)[0]
    gyro, servo = rows[:mark], rows[mark + 1 :]
    step = np.diff(servo[:, 1])
    step -= 5760 * np.round(step / 5760)
    angle = servo[0, 1] + np.concatenate([[0], np.cumsum(step)])
    inside = (gyro[:, 0] >= servo[0, 0]) & (gyro[:, 0] <= servo[-1, 0])
    time = gyro[inside, 0]
    table = np.column_stack([time, np.interp(time, servo[:, 0], angle), gyro[inside, 2:5]])
    head = "time_s,angle_deg,gyro_x,gyro_y,gyro_z"
    np.savetxt(f"test_{test}.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
