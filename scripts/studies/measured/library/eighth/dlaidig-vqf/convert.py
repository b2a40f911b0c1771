"""The two rests of the unit (0 to 7 s and 44 s to the end) alone, with their times."""

import numpy as np

ENDS, BEGINS = 7.0, 44.0

log = np.load("raw/tests/imu_data.npz")
time = np.arange(len(log["gyr"])) / log["sampling_rate"]
rests = (time < ENDS) | (time >= BEGINS)
np.savez("rests.npz", t=time[rests], gyr=log["gyr"][rests].astype(float), acc=log["acc"][rests].astype(float))
