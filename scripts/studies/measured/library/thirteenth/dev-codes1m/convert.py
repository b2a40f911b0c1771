"""The first rows: rates beside the angles that the unit's own attitude (w, x, y, z) turned about its own axes."""

import numpy as np
from scipy.spatial.transform import Rotation
from turned import body_angles

rows = np.genfromtxt("raw/IMU_Data_1.csv", delimiter=",", skip_header=1, max_rows=12000)
table = np.hstack((rows[:, :3], body_angles(Rotation.from_quat(rows[:, [13, 14, 15, 12]]))))
np.savetxt("turned.csv", table, fmt="%.9f", delimiter=",", header="gx,gy,gz,angle_x,angle_y,angle_z", comments="")
