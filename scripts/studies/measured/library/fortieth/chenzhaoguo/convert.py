"""A simulated unit on an ellipse, whose roll and pitch swing: gyros with noise beside the rates without, at 200 Hz.

Of the accelerometers stands what the noise has added: the noisy file less the other.
"""

from pathlib import Path

import numpy as np

true = np.loadtxt(Path("raw/bin/imu_pose.txt"))
noisy = np.loadtxt(Path("raw/bin/imu_pose_noise.txt"))
table = np.column_stack([true[:, 0], true[:, 8:10], noisy[:, 8:10], noisy[:, 11:14] - true[:, 11:14]])
head = "time_s,true_x,true_y,gyro_x,gyro_y,added_x,added_y,added_z"
np.savetxt("simulated.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
