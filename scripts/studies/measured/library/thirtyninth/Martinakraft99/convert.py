"""A helicopter on a bench turned by hand about one axis after another, its gyro beside the encoder, 500 rows a second.

The encoders give angles in radians; the gyro is as the unit sends it. On the ground the first rows hold nothing yet.
"""

from pathlib import Path

import numpy as np
from scipy.io import loadmat

RAW = Path("raw")
TURNED = RAW / "Lab_D3/Task_1_IMU_characteristics"
for name, folder, angle, axis in (("pitch", "p", 3, 1), ("elevation", "e", 5, 2), ("travel", "t", 1, 3)):
    gyro = loadmat(TURNED / folder / "gyro_raw.mat")["ans"]
    encoder = loadmat(TURNED / folder / "x_enc.mat")["ans"]
    table = np.column_stack([gyro[0], encoder[angle], gyro[axis]])
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time_s,angle_rad,gyro_rad_s", comments="", fmt="%.9g")
rows = loadmat(RAW / "Lab_D4/Task_1_Noise_estimate/y_vector_ground.mat")["ans"].T[3:, [0, 2, 4, 5]]
head = "time_s,pitch_rad_s,elevation_rad_s,travel_rad_s"
np.savetxt("ground.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
