"""A copter with a gimbal: two units of its autopilot on one clock in flight, and a log while it stands.

Of a flight the rows that both units wrote at one time [us]. Of the log `LOG6` the rows in which nothing is touched.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

RAW = Path("raw")
FLIGHTS = {
    "flight8": "2017-12-05 09-33-04 8.bin-53568",
    "flight11": "2017-12-05 09-43-01 11.bin-36195",
    "flight6": "2017-12-06 11-34-27 6.bin-62862",
}
STILL = slice(1500, 14400)


def write(name: str, head: str, table: np.ndarray) -> None:
    np.savetxt(f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%.10g")


for name, log in FLIGHTS.items():
    held = loadmat(RAW / f"{log}.mat")
    first, second = held["IMU"], held["IMU2"]
    times, i, j = np.intersect1d(first[:, 1], second[:, 1], return_indices=True)
    table = np.column_stack([(times - times[0]) * 1e-6, first[i, 2:5], second[j, 2:5], second[j, 10]])
    write(name, "time_s,gyro1_x,gyro1_y,gyro1_z,gyro2_x,gyro2_y,gyro2_z,temp2_c", table)
rows = loadmat(RAW / "LOG6.BIN-17484.mat")["IMU"][STILL]
write(
    "quiet",
    "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z",
    np.column_stack([(rows[:, 1] - rows[0, 1]) * 1e-6, rows[:, 2:8]]),
)
