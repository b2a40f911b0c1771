"""Angles that a body turned about its own axes, out of its attitudes, for the converters of the measured library."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from insenv.core.recording import Floats


def body_angles(attitude: Rotation) -> Floats:
    """Sums of the parts of the rotations between rows about x, y and z [rad], zero at the first: shape (n, 3)."""
    turned = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
    return np.concatenate((np.zeros((1, 3)), np.cumsum(turned, axis=0)))
