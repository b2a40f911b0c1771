"""Gyros of the slave beside the angles that the master turned about the body's axes, on the slave's rows.

The master's attitude (yaw to the left, pitch, roll) stands at 12.5 Hz; what it turned from row to row is put into the
axes of the body (x forward, y up, z to the right), summed up, and drawn straight between its rows.
"""

import numpy as np
from scipy.interpolate import interp1d
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

slave, master = (loadmat(f"raw/{name}.mat")[name] for name in ("slave", "master"))
attitude = Rotation.from_euler("ZYX", master[:, 7:10] * [-1, 1, 1], degrees=True)
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec(degrees=True)[:, [0, 2, 1]] * [1, -1, 1]
angles = interp1d(master[:, 0], np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0))), axis=0)
both = slave[(slave[:, 0] >= master[0, 0]) & (slave[:, 0] <= master[-1, 0])]
roll, yaw, pitch = angles(both[:, 0]).T
np.savez("flight.npz", t=both[:, 0], gx=both[:, 1], gy=both[:, 2], gz=both[:, 3], roll=roll, yaw=yaw, pitch=pitch)
