"""The optical attitude, rotation vectors, as angles about the head's axes: turns from row to row, summed up.

The vectors turn the other way than the head's axes.
"""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

log = loadmat("raw/dataset3.mat")
turn = Rotation.from_rotvec(log["theta_vk_i"].T)
angle = -np.cumsum(np.vstack([np.zeros(3), (turn[:-1].inv() * turn[1:]).as_rotvec()]), axis=0)
table = np.column_stack([log["t"].ravel(), log["w_vk_vk_i"].T, angle])
head = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("head.csv", table, delimiter=",", header=head, comments="", fmt="%.12g")
