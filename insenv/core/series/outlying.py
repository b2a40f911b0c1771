"""What is an outlier of a series: a value far off its neighbours on both sides, by more than noise and motion make.

It lies on the same side of the medians of its neighbours before and after, by more than

    max(8 s, 5 s + q) + r,      s the local robust deviation, r the range of the table's rate nearby,
                                q what rounding of the readings moves a row by

A step, a ramp or a slow effect moves one side along; an error of timing, a lock-in, a fault around one rate are bounded
by how much the rate changes there; a table's disturbance at one angle comes back with every turn and is kept.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insenv.core.series.robust import OF_MEDIAN
from insenv.core.series.stretches import stretches

Floats = NDArray[np.float64]

#: Robust standard deviations; a Gaussian bin is that far out with probability 1e-15.
FAR = 8.0
#: The same where rounding alone may have moved a row: of a rare step to the next number the deviation knows nothing.
ROUNDED = 5.0
#: Share of its largest value to which a reference is exact as it is computed.
EXACT = 1e-9
#: Bins whose median a bin is compared with.
NEIGHBOURS = 9
#: Steps of the readings that their deviation must have to be told by the median.
FINE = 2.0
#: Largest share that may be outliers: more of them are how the instrument is.
MOST = 0.01
#: Longest outlier that a scale finds, in its means: three neighbours on, medians begin.
LONGEST = 3
#: Rows over which the local deviation is taken.
LOCAL = 256
#: Outliers from which their angles are looked at, and the probability that chance gathers them at one.
FEWEST_ANGLES, AT_ONE_ANGLE = 5, 1e-3


def unseen(
    reading: Floats, reference: Floats, coarse: float = 0.0, beside: int = 0
) -> tuple[NDArray[np.bool_], Floats]:
    """Rows in which a reference leaps away and back and a reading of it has seen nothing, and by how much of far.

    Parameters
    ----------
    reading, reference : ndarray, shape (n,)
        In one unit; the reading is of the reference.
    coarse : float
        What rounding moves a value of the reference by.
    beside : int
        Rows on either side in which it may have been seen, by a reading that is early or late.
    """
    from scipy.ndimage import maximum_filter1d, median_filter  # slow to import

    seen, level = (median_filter(x, size=NEIGHBOURS, mode="nearest") for x in (reading, reference))
    exact = EXACT * float(np.abs(reference).max(initial=0.0))
    away = far(reference, 0.3 * level, 0.3 * level, max(coarse, exact))
    moved = maximum_filter1d(np.abs(reading - seen), 2 * beside + 1)
    return (away > 1) & (moved < 0.3 * np.abs(reference - level)), away


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
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # slow to import

    least, left = _off_neighbours(x)
    width = 2 * (LONGEST + 2 * (NEIGHBOURS // 2)) + 1
    moved = maximum_filter1d(high, width) - minimum_filter1d(low, width)
    allowed = _allowed(_local(np.abs(left), _robust), coarse) + moved
    return np.nan_to_num(least / np.where(allowed > 0, allowed, np.inf))


def far_of_many(x: Floats, coarse: float) -> Floats:
    """The same of a series that does not move, where up to a third of the values may be far off.

    The deviation is told by the median alone: a tenth of the values that is far off makes the other one as large as
    they are. Of readings as ``coarse`` as their noise it tells nothing.
    """
    least, left = _off_neighbours(x)
    size = np.abs(left)
    noise, robust = _local(size, _by_median), _local(size, _robust)
    allowed = np.where(noise > FINE * coarse, FAR * noise, _allowed(robust, coarse))
    return np.nan_to_num(least / np.where(allowed > 0, allowed, np.inf))


def _allowed(noise: Floats, coarse: float) -> Floats:
    """How far noise and rounding may move a value."""
    return np.maximum(FAR * noise, ROUNDED * noise + 1.1 * coarse)


def _off_neighbours(x: Floats) -> tuple[Floats, Floats]:
    """Distance of each value from the medians before, after and around it, 0 where they disagree; less the last one."""
    from scipy.ndimage import median_filter  # slow to import

    reach = LONGEST + NEIGHBOURS // 2
    middle = median_filter(x, size=NEIGHBOURS, mode="nearest")
    before, after = np.full(len(x), np.nan), np.full(len(x), np.nan)
    before[reach:], after[:-reach] = middle[:-reach], middle[reach:]
    a, b, c = x - before, x - after, x - middle
    alike = (np.sign(a) == np.sign(b)) & (np.sign(a) == np.sign(c))
    # Far from the median around it as well: the crest of a slow wave is far from both sides, but not from that.
    return np.where(alike, np.minimum(np.minimum(np.abs(a), np.abs(b)), np.abs(c)), 0.0), c


def _local(size: Floats, robust: Callable[[Floats], Floats]) -> Floats:
    """Local deviation of what has these sizes, shape (n,): the largest of a stretch and those beside, or of all."""
    from scipy.ndimage import maximum_filter1d  # slow to import

    n = len(size)
    count = max(1, n // LOCAL)
    length = n // count
    local = robust(size[: count * length].reshape(count, length))
    whole = robust(size[None, :: max(1, n // 20000)])[0]
    return np.maximum(maximum_filter1d(local, 3), whole)[np.minimum(np.arange(n) // length, count - 1)]


def _robust(size: Floats) -> Floats:
    """Deviation of each row of sizes, shape (rows,): by the median, or the 90 % quantile where that is more.

    Of coarse readings most may be the same.
    """
    middle, high = size.shape[1] // 2, int(0.9 * (size.shape[1] - 1))
    parted = np.partition(size, (middle, high), axis=1)
    return np.maximum(OF_MEDIAN * parted[:, middle], parted[:, high] / 1.645)


def _by_median(size: Floats) -> Floats:
    """The same by the median."""
    deviation: Floats = OF_MEDIAN * np.median(size, axis=1)
    return deviation


def at_one_angle(angle: Floats, spikes: NDArray[np.bool_]) -> bool:
    """Whether the outliers of several turns gather at one ``angle`` [rad] of the table (Rayleigh's test)."""
    at = np.array([angle[a] for a, _ in stretches(spikes)])
    if len(at) < FEWEST_ANGLES or np.ptp(at) < 2 * np.pi * (FEWEST_ANGLES - 1):
        return False
    return bool(np.exp(-len(at) * np.abs(np.exp(1j * at).mean()) ** 2) < AT_ONE_ANGLE)
