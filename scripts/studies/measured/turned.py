"""Angles that a body turned about its own axes, and its rates, out of its attitudes, for converters of the library."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from insenv.core.recording import Floats


def body_angles(attitude: Rotation) -> Floats:
    """Sums of the parts of the rotations between rows about x, y and z [rad], zero at the first: shape (n, 3)."""
    turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))


def body_rates(attitude: Rotation, time: Floats) -> Floats:
    """Rates about the body's axes over two rows [rad/s], without the first and the last row: shape (n - 2, 3)."""
    return np.asarray((attitude[:-2].inv() * attitude[2:]).as_rotvec() / (time[2:] - time[:-2])[:, None])
