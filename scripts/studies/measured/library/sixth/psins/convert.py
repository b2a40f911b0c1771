"""The MEMS unit's increments summed over the FOG INS' rows (0.1 s), beside the INS' attitude as body angles.

The attitude is pitch, roll, yaw of right-front-up axes; the angle about a body axis is the sum of its part of the
rotations between rows, so that a gyro on that axis can be held against it.
"""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation
from turned import body_angles

told = loadmat("raw/data/transfer_align_fog_mems.mat")
mems, ins = told["mimu"], told["fogavp"]
attitude = Rotation.from_euler("ZXY", ins[:, [2, 0, 1]])
angle = body_angles(attitude)
total = np.cumsum(mems[:, :3], axis=0)
at = np.searchsorted(mems[:, 6], ins[:, 9] + 1e-6) - 1
gyro = np.diff(total[at], axis=0, prepend=np.zeros((1, 3)))
rows = np.column_stack([ins[:, 9], gyro, angle])[1:]
names = "time,gyro_x,gyro_y,gyro_z,angle_x,angle_y,angle_z"
np.savetxt("mems_ins.csv", rows, delimiter=",", header=names, comments="", fmt="%.15g")
