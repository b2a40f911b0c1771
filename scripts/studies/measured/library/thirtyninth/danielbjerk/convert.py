"""A helicopter on a bench turned about one axis, its gyro beside the rate of the encoder, and the unit lying still.

500 rows a second; what comes before the turns, and before the unit answers, is left out.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

RAW = Path("raw/Versions")
for name, first in (("pitch", 14000), ("travel", 18000)):
    (file,) = RAW.glob(f"Part 3/Task 1 & 2/*/p3t1_gyro-and-enc-one-axis_{name}-rate.mat")
    rows = loadmat(file)["ans"].T[first:, [0, 2, 1]]
    head = "time_s,encoder_rad_s,gyro_rad_s"
    np.savetxt(f"{name}.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
(file,) = RAW.glob("Part 4/Task 1/*/p4t1_noise-estimation-laying-still_full-IMU_v1.mat")
rows = loadmat(file)["ans"].T[500:, [0, 2, 4, 5]]
head = "time_s,pitch_rad_s,elevation_rad_s,travel_rad_s"
np.savetxt("still.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
