"""A quadrotor on a stand that lets it roll and pitch: angles of its attitude unit beside rates of its gyros, 50 Hz."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

HERE = Path("raw/Code/Simulink/Quadcopter/Calibration/LQIDG")
for file, name, variable, angle, rate in (
    ("Roll_Pitch/roll_pitch_squre_400_sec.mat", "long", "roll_pitch_LQIDG", (0, 1), (2, 3)),
    ("Roll_Pitch/test.mat", "short", "simout", (0, 1), (2, 3)),
    ("Roll-Pitch-Yaw/weight.mat", "weight", "simout", (0, 1), (3, 4)),
):
    data = loadmat(HERE / file)[variable]
    rows = np.column_stack([np.arange(len(data)) * 0.02, data[:, angle], data[:, rate]])
    head = "time_s,roll,pitch,roll_rate,pitch_rate"
    np.savetxt(f"{name}.csv", rows, delimiter=",", header=head, comments="", fmt="%.8g")
