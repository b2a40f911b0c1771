"""The first minute of a quadrotor's navigation board, in which it stands on the floor: at 64 s it is taken up."""

import numpy as np

rows = np.genfromtxt("raw/pc/plotting/bearing/logs/drone_1_1.csv", delimiter=",", skip_header=1)[:12000, :6]
np.savetxt("still.csv", rows, delimiter=",", header="ax,ay,az,gx,gy,gz", comments="", fmt="%.8g")
