"""The robot's attitude as the angle about the unit's z axis, by its stamps on arrival, beside the gyro.

The robot's quaternions turn the other way than the unit's axes. They came at 15 Hz, and the owner has put each at the
rows until the next.
"""

import numpy as np
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

for folder in ("eV50p", "V_300"):
    log = loadmat(f"raw/DataSets/{folder}/Sequencia1/MPU9150.mat")
    gyro = log["SENSgyro"][2]
    known = np.isfinite(gyro)
    turn = Rotation.from_quat(np.roll(log["ABBquaternion"].T[known], -1, axis=1))
    angle = -np.concatenate([[0.0], np.cumsum((turn[:-1].inv() * turn[1:]).as_rotvec()[:, 2])])
    table = np.column_stack([log["MATLABtime"].ravel()[known], gyro[known], angle])
    name = folder.lower()
    np.savetxt(f"{name}.csv", table, delimiter=",", header="time,gyro_z,angle", comments="", fmt="%.12g")
