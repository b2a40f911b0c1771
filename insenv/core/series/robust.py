"""Robust standard deviations: half of all values stay what they are, however far off the others lie.

    s = 1.4826 median |x|,          median |x| = 0.6745 s = s / 1.4826   of normal noise without a mean

What has a mean is given less its median: the median absolute deviation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Median of the size of a standard normal, and its inverse: deviations in a median of sizes.
MEDIAN, OF_MEDIAN = 0.6745, 1.4826


def robust_deviation(x: Floats) -> float:
    """Standard deviation of ``x`` about nothing: 1.4826 median |x|."""
    return OF_MEDIAN * float(np.median(np.abs(x)))


def noise_of_steps(steps: Floats) -> float:
    """White noise of values, by the steps from each to the next: 1.4826 median |x| / sqrt(2)."""
    return OF_MEDIAN / np.sqrt(2) * float(np.median(np.abs(steps)))
