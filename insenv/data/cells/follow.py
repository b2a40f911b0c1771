"""The rate of a table behind a reading with errors of its own.

A rate that is differenced from an encoder's angle carries the encoder's jitter, and so does what an instrument reads
beside it, y - u: any curve of such a rate would "explain" that jitter. The rate that regressors are made of is
therefore a mean over as many samples as the motion allows: of the windows of 1, 3, 5, 9, 17 ... samples around each
one, the widest whose mean agrees with those of all narrower ones,

    max_j (m_j - G s_j) <= min_j (m_j + G s_j),        s_j = s_0 / w_j

with w_j samples in the window and s_0 by the third differences of the rate: an angle's jitter falls that fast. At a
step of the rate the windows end. The noise of a rate that was itself measured falls as the root of w_j.

Source: A. Goldenshluger and A. Nemirovski, Mathematical Methods of Statistics 6 (1997) 135 (intersection of
confidence intervals).

A reading that is late, early, reversed or of another gain is first brought to the rate: at the shift at which the two
correlate most, over their ratio there. Else an instrument half a period late would seem to follow nothing.
Where the instrument follows the smaller half of the third differences, or what the windows leave out, that was motion
and no jitter: the rate is left as it is. At the corners of a motion, where the windows are narrow, this is asked apart
from all the rest, and only where more is left out than jitter makes: what is less is too small a part of such a rate to
bend a curve of it. A rate whose interval holds zero is zero.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.core.series.robust import MEDIAN

#: Half-width of a confidence interval in standard deviations.
GAMMA = 4.0
#: Share of what the windows leave out that the instrument must follow for it to be motion.
FOLLOWED = 0.5
#: Share of the square sum of what was left out that an instrument may miss of a motion.
UNREAD = 0.1
#: Rows beside each other that undo a filter, and fewest rows for each.
TAPS, EACH = 7, 100
#: Width of a window up to which a sample stands at a corner of the motion, and what jitter makes at most there, in its
#: standard deviations.
NARROW, LARGEST = 5, 2.5
#: Rows of the longest shift that is looked for, the correlation from which on there is one, and the shift in rows and
#: the departure of a gain from one that do not matter.
LONGEST, CORRELATED, NEAR, SMALL = 64, 0.7, 0.1, 0.2
#: Share of the square sum of a rate up to which it is one rate but for rounding, which tells no shift and no ratio.
STEADY = 1e-20
#: By what was read: variance of the third differences of its jitter, in that of one rate, and the power of the window's
#: width with which its standard deviation falls. An angle whose rows stand between the edges is first averaged over two
#: of them, (1, -3, 2, 2, -3, 1)^2 / 2; where they stand at the edges it is (1, -4, 6, -4, 1)^2 / 2 = 35, and the
#: intervals are wider than need be.
_LAWS = {"angle": (14.0, 1.0), "rate": (20.0, 0.5)}


def followed(rate: Floats, reading: Floats, known: NDArray[np.bool_], of: Literal["angle", "rate"]) -> Floats:
    """The rate for regressors, shape (n,).

    Parameters
    ----------
    rate : ndarray, shape (n,)
        Mean rate over even intervals.
    reading : ndarray, shape (n,)
        What an instrument that turns along reads in the same intervals [same unit].
    known : ndarray of bool, shape (n,)
        Where the instrument's reading is known.
    of : str
        What the rate was read from.
    """
    third, falls = _LAWS[of]
    reading = _alongside(rate, reading, known)
    jitter = _jitter(rate) / np.sqrt(third)
    if jitter == 0 or _shakes(rate, reading, known, MEDIAN * jitter * np.sqrt(third)):
        return rate
    calm, width = _widest(rate, jitter, falls)
    found, narrow = calm.copy(), width <= NARROW
    for part in (narrow & (np.abs(rate - calm) > LARGEST * jitter), ~narrow):
        if _follows(reading - calm, rate - calm, known & part):
            found[part] = rate[part]
    # A table that cannot be told from one that stands is taken to stand: curves bend most at small rates.
    return np.where(np.abs(calm) <= GAMMA * jitter / width**falls, 0.0, found)


def follows(change: Floats, smooth: Floats, reading: Floats, known: NDArray[np.bool_]) -> bool:
    """Whether an instrument reads nearly all that a smooth motion leaves out of a table's, shape (n,) each.

    By itself, or behind a filter: what that makes of the motion a few rows beside each other undo.
    """
    left, read = change - smooth, _alongside(change, reading, known) - smooth
    allowed = UNREAD * float(left[known] @ left[known])
    unread = (left - read)[known]
    if float(unread @ unread) < allowed:
        return True
    if len(left) < EACH * TAPS:
        return False
    ends = slice(TAPS // 2, len(left) - TAPS // 2)
    beside, rows = sliding_window_view(read, TAPS)[known[ends]], left[ends][known[ends]]
    beside, rows = beside - beside.mean(axis=0), rows - rows.mean()
    unread = rows - beside @ np.linalg.lstsq(beside, rows, rcond=1e-9)[0]
    return bool(float(unread @ unread) < UNREAD * float(rows @ rows))


def _alongside(rate: Floats, reading: Floats, known: NDArray[np.bool_]) -> Floats:
    """The reading at the time and in the unit of the rate, where the two tell shift and ratio, shape (n,)."""
    most = min(LONGEST, len(rate) // 8)
    if most < 1 or not known.any():
        return reading
    rest = known.astype(np.float64)
    varied = float(np.sum(rest * (rate - np.average(rate, weights=rest)) ** 2))
    if varied <= STEADY * float(np.sum(rest * rate**2)):
        return reading
    both, power = correlation(rate, reading, rest, most + 1)
    near = both / np.sqrt(np.maximum(power, 1e-300))
    at = 1 + int(np.argmax(np.abs(near[1:-1])))
    if not abs(near[at]) > CORRELATED:
        return reading
    bend = float(near[at - 1] - 2 * near[at] + near[at + 1])
    shift = at - most - 1 + (0.5 * float(near[at - 1] - near[at + 1]) / bend if bend else 0.0)
    rows = np.arange(float(len(rate)))
    moved = np.interp(rows + shift, rows, reading) if abs(shift) > NEAR else reading
    gain = float(both[at]) / varied
    return moved / gain if abs(gain - 1) > SMALL else moved


def correlation(u: Floats, y: Floats, weights: Floats, most: int) -> tuple[Floats, Floats]:
    """Sums of ``y`` times ``u`` so many rows before, for shifts ``-most`` to ``most``, and what they could be at most.

    ``u`` is known in every row, ``y`` by its ``weights``: a row that is lost to both would be missed less at no shift.

    What they could be is of the rows that a shift leaves both of them, and squared, shape (2 most + 1,): without
    that every row of shift costs a row of the sum, which of slow motion is more than the shift is worth.
    """
    u, y = (x - np.average(x, weights=weights) for x in (u, y))
    y, n = y * weights, len(u)
    size = 1 << (2 * n - 1).bit_length()
    both, of_u = (
        np.fft.irfft(np.fft.rfft(later, size) * np.conj(np.fft.rfft(before, size)), size)
        for later, before in ((y, u), (weights, u**2))
    )
    shifts = np.arange(-most, most + 1)
    of_y = np.concatenate([[0.0], np.cumsum(y**2)])
    late, early = np.maximum(shifts, 0), np.maximum(-shifts, 0)
    power = np.maximum(of_u[shifts], 0.0) * (of_y[n - early] - of_y[late])
    return both[shifts], power


def _shakes(rate: Floats, reading: Floats, known: NDArray[np.bool_], most: float) -> bool:
    """Whether the smaller half of the third differences of a rate is motion that the instrument reads, too."""
    change = np.diff(rate, 3)
    used = known[3:] & known[2:-1] & known[1:-2] & known[:-3] & (np.abs(change) <= most)
    return _follows(np.diff(reading, 3), change, used)


def _follows(read: Floats, left: Floats, used: NDArray[np.bool_]) -> bool:
    """Whether an instrument reads what the windows left out, too."""
    power = float(left[used] @ left[used])
    return power > 0 and float(left[used] @ read[used]) > FOLLOWED * power


def _jitter(rate: Floats) -> float:
    """Standard deviation of the third differences, by their median: they feel neither smooth motion nor a few steps."""
    third = np.diff(rate, 3)
    return float(np.median(np.abs(third)) / MEDIAN) if len(third) else 0.0


def _widest(rate: Floats, jitter: float, falls: float) -> tuple[Floats, NDArray[np.int64]]:
    """Mean over the widest window around each sample that agrees with all narrower ones, and its width [samples]."""
    n = len(rate)
    total = np.concatenate([[0.0], np.cumsum(rate - rate.mean())])
    index = np.arange(n)
    best, widest = rate.copy(), np.ones(n, np.int64)
    low, high = rate - GAMMA * jitter, rate + GAMMA * jitter
    going = np.ones(n, dtype=bool)
    half = 1
    while 2 * half + 1 <= n and going.any():
        reach = np.minimum(half, np.minimum(index, n - 1 - index))  # even about the sample at the ends too
        width = 2 * reach + 1
        mean = (total[index + reach + 1] - total[index - reach]) / width + rate.mean()
        slack = GAMMA * jitter / width**falls
        low, high = np.maximum(low, mean - slack), np.minimum(high, mean + slack)
        going &= low <= high
        best[going], widest[going] = mean[going], width[going]
        half *= 2
    return best, widest
