"""The minute and a half before lift-off, 752 to 832 s, in which nobody touches the rocket on its pad."""

import numpy as np

rows = np.genfromtxt("raw/flight_sensor_input_data/launch_data_file-6dof_nov2022_carlos.txt")
rows = rows[(rows[:, 0] > 752.0) & (rows[:, 0] < 832.0)]
np.savetxt("pad.csv", rows, fmt="%.9g", delimiter=",", header="t,ax,ay,az,gx,gy,gz", comments="")
