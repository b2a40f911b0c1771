"""The log counts every loop as 5 ms; here each row has the sum of the loops' measured times (`dt_ms`) beside it."""

import numpy as np

LOG = "raw/data/pool_tests/fpd_tune_data_20260406_232617.csv"
COLUMNS = ("imu1_pitch_deg", "imu1_pitch_rate_dps", "imu2_pitch_deg", "imu2_pitch_rate_dps")

log = np.genfromtxt(LOG, delimiter=",", names=True, usecols=("dt_ms", *COLUMNS))
time = np.cumsum(log["dt_ms"]) * 1e-3
rows = np.column_stack([time, *(log[name] for name in COLUMNS)])
np.savetxt("clock.csv", rows, delimiter=",", header=",".join(("time_s", *COLUMNS)), comments="", fmt="%.8g")
