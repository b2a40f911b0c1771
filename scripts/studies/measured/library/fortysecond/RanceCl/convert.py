"""A unit of accelerometers in g and gyros that is laid on three of its faces and moved between, a minute at 20 Hz."""

from pathlib import Path

import numpy as np

held = np.genfromtxt(Path("raw/acc_gyro.txt"), skip_header=1)[:, :7]
head = "time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z"
np.savetxt("faces.csv", held, delimiter=",", header=head, comments="", fmt="%.9g")
