r"""Least absolute deviations: a fit that a few wrong readings do not pull.

    b = arg min sum_i |y_i - x_i b|

by squares that are weighted anew with one over the size of what is left.

Source: P. J. Huber, Robust Statistics (1981), section 7; Schlossmacher, J. Am. Stat. Assoc. 68 (1973) 857.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Passes, and the least size of what is left, as a share of the largest, that a weight is taken of.
PASSES, LEAST = 30, 1e-6


def least_absolute(columns: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Coefficients of ``columns``, shape (n, k), and what they leave of ``y``, shape (n,)."""
    theta = np.asarray(np.linalg.lstsq(columns, y, rcond=None)[0], np.float64)
    for _ in range(PASSES):
        left = np.abs(y - columns @ theta)
        root = 1 / np.sqrt(np.maximum(left, LEAST * max(float(left.max()), 1e-300)))
        theta = np.asarray(np.linalg.lstsq(columns * root[:, None], y * root, rcond=None)[0], np.float64)
    return theta, y - columns @ theta
