"""What is an outlier of a series: a value far off its neighbours on both sides, by more than noise and motion make.

It lies on the same side of the medians of its neighbours before and after, by more than

    max(8 s, 5 s + q) + r,      s the local robust deviation, r the range of the table's rate nearby,
                                q what rounding of the readings moves a row by

A step, a ramp or a slow effect moves one side along; an error of timing, a lock-in, a fault around one rate are bounded
by how much the rate changes there; a table's disturbance at one angle comes back with every turn and is kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insenv.core.series.stretches import stretches

Floats = NDArray[np.float64]

#: Robust standard deviations; a Gaussian bin is that far out with probability 1e-15.
FAR = 8.0
#: The same where rounding alone may have moved a row: of a rare step to the next number the deviation knows nothing.
ROUNDED = 5.0
#: Bins whose median a bin is compared with.
NEIGHBOURS = 9
#: Largest share that may be outliers: more of them are how the instrument is.
MOST = 0.01
#: Longest outlier that a scale finds, in its means: three neighbours on, medians begin.
LONGEST = 3
#: Rows over which the local deviation is taken.
LOCAL = 256
#: Outliers from which their angles are looked at, and the probability that chance gathers them at one.
FEWEST_ANGLES, AT_ONE_ANGLE = 5, 1e-3


def far(x: Floats, high: Floats, low: Floats, coarse: float) -> Floats:
    """Distance of each value from the medians before and after it, of what is allowed; 0 where they disagree.

    Parameters
    ----------
    x : ndarray, shape (n,)
    high, low : ndarray, shape (n,)
        Bounds of the table's rate there, in the unit of ``x``.
    coarse : float
        What rounding moves a value by.
    """
    from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d  # slow to import

    half = NEIGHBOURS // 2
    reach = LONGEST + half
    middle = median_filter(x, size=NEIGHBOURS, mode="nearest")
    before, after = np.full(len(x), np.nan), np.full(len(x), np.nan)
    before[reach:], after[:-reach] = middle[:-reach], middle[reach:]
    a, b, c = x - before, x - after, x - middle
    alike = (np.sign(a) == np.sign(b)) & (np.sign(a) == np.sign(c))
    # Far from the median around it as well: the crest of a slow wave is far from both sides, but not from that.
    least = np.where(alike, np.minimum(np.minimum(np.abs(a), np.abs(b)), np.abs(c)), 0.0)
    width = 2 * (reach + half) + 1
    moved = maximum_filter1d(high, width) - minimum_filter1d(low, width)
    noise = _deviation(x - middle)
    allowed = np.maximum(FAR * noise, ROUNDED * noise + 1.1 * coarse) + moved
    return np.nan_to_num(least / np.where(allowed > 0, allowed, np.inf))


def _deviation(left: Floats) -> Floats:
    """Local robust standard deviation, shape (n,): the largest of a stretch and those beside it, or of the whole.

    By the median, or by the 90 % quantile where that is more, as of coarse readings.
    """
    from scipy.ndimage import maximum_filter1d  # slow to import

    n, size = len(left), np.abs(left)
    count = max(1, n // LOCAL)
    length = n // count
    local = _robust(size[: count * length].reshape(count, length))
    whole = _robust(size[None, :: max(1, n // 20000)])[0]
    return np.maximum(maximum_filter1d(local, 3), whole)[np.minimum(np.arange(n) // length, count - 1)]


def _robust(size: Floats) -> Floats:
    """Deviation of each row of sizes, shape (rows,)."""
    middle, high = size.shape[1] // 2, int(0.9 * (size.shape[1] - 1))
    parted = np.partition(size, (middle, high), axis=1)
    return np.maximum(1.4826 * parted[:, middle], parted[:, high] / 1.645)


def at_one_angle(angle: Floats, spikes: NDArray[np.bool_]) -> bool:
    """Whether the outliers of several turns gather at one ``angle`` [rad] of the table (Rayleigh's test)."""
    at = np.array([angle[a] for a, _ in stretches(spikes)])
    if len(at) < FEWEST_ANGLES or np.ptp(at) < 2 * np.pi * (FEWEST_ANGLES - 1):
        return False
    return bool(np.exp(-len(at) * np.abs(np.exp(1j * at).mean()) ** 2) < AT_ONE_ANGLE)
