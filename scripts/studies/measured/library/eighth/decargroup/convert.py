"""The published attitude of EuRoC MH_01: what it turned about the axes of the unit, for the gyros of `kalebburnham`."""

import numpy as np
from scipy.spatial.transform import Rotation

truth = np.loadtxt("raw/data/MH_01_easy.txt")
attitude = Rotation.from_quat(truth[:, 4:8])
turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
np.savez("attitude.npz", t=truth[:, 0], angles=np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0))))
