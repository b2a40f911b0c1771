"""Rates of a simulated quadrotor beside the angles that its attitude (w, x, y, z) turned about the body's axes."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

table = np.genfromtxt("raw/resources/quadrotor_model.csv", delimiter=",", skip_header=1, usecols=range(16))
time = (table[:, 1] - table[0, 1]) * 1e-6
rows = np.column_stack([time, table[:, 13:16], body_angles(Rotation.from_quat(table[:, [10, 11, 12, 9]]))])
head = "t,gx,gy,gz,angle_x,angle_y,angle_z"
np.savetxt("quadrotor.csv", rows, fmt="%.9f", delimiter=",", header=head, comments="")
