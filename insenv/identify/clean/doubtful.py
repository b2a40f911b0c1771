r"""How fast a motion may be for a measured reference to tell an instrument's errors.

    y = g x + e,      u = x + v        x the motion, v the errors of its reference, e those of the instrument

v makes a gain that is fitted too small by the ratio of powers |v|^2 / |u|^2, and the fit never knows whose the rest is:
at each frequency up to |r|^2 / |u|^2 with r = y - g u. Weighted by its power over that of the rest, s = |u|^2 / |r|^2,
as a fit weights n modes, the gain is off by at most

    sum_k s_k (1 / s_k) / sum_k s_k = n / sum s        beside its standard deviation (sum s)^-1/2

Slow modes have nearly all of s, fast ones all of n: an attitude by cameras follows a hand to a thousandth at 0.5 Hz
and to a quarter at 10 Hz, and with the latter in the fit the gain is 3 % short, from which drifts and curves follow.
So modes are taken up to the frequency up to which the one is no more than the other, n^2 <= sum s, or up to which
nearly all of the motion is: bins are as long as that. A reference without errors of its own tells at all frequencies.

Errors may be larger than that, and go with the rate: stamps by arrival, off by e_i, are u e_i in the angle, and half of
the rate of a row. The rows that move are then the ones far off, and no fit of rows tells the gain. Errors of an angle
fall with the time m of a mean, the motion does not, and so the gain settles:

    g_m = gain of running means over m rows,    |g_m - g_M| <= G hypot(s_m, s_M)  for all M > m

Bins are no shorter than the shortest mean from which on all gains agree, and the surest of these gains is taken.

Source: J. A. Hausman, Specification tests in econometrics, Econometrica 46 (1978) 1251: two estimates of which an error
in the variable moves one more than the other; O. V. Lepskii, Theory Probab. Appl. 35 (1990) 454.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.data.reference import order
from insenv.identify.clean.response.fit import FAR, fitted
from insenv.identify.clean.response.stretches import Stretch, stretches

#: Share of the square sum of the rate that bins must leave, modes of a band at least, and the ratio of its ends.
MOTION, FEWEST, RATIO = 0.9, 8, 1.25
#: Ratio of a mean's rows to those of the next shorter one, the longest [s], and their fewest in a stretch; deviations
#: by which two gains differ, and a difference that does not matter.
LONGER, LONGEST, MEANS, AGREE, SAME = 2, 5.12, 50, 3.0, 0.002
#: Readings in a mean, of references that are read less often than after this time [s].
READINGS, SLOW = 2.0, 0.5


#: Share of the largest rate from which on there is motion, change from row to row below which it holds, and how often.
MOVES, HOLDS, OFTEN = 0.1, 1e-3, 0.3


@dataclass(frozen=True)
class Settled:
    """A run whose reference has errors: rows of the means ``over`` which its gain has settled, gain and lag [s]."""

    run: int
    over: int
    gain: float
    lag: float


def settled(parts: list[Stretch]) -> tuple[Settled, ...]:
    """What tells the gain of each run: running means that agree with all longer ones."""
    return tuple(_settled(one) for one in parts)


def doubted(
    recordings: tuple[Recording, ...], spans: tuple[slice, ...], target: str, rows: tuple[NDArray[np.bool_], ...]
) -> list[Stretch]:
    """The stretches of runs with references that have errors of their own, if all have.

    Parameters
    ----------
    recordings : tuple of Recording
    spans : tuple of slice
        Rows that are looked at in each, contiguous and fitted.
    target : str
    rows : tuple of ndarray of bool
        All rows that may be fitted: where gaps leave no long stretch, they are looked at.
    """
    if not target.startswith("gyro") or not all(map(doubtful, recordings)):
        return []
    return stretches(recordings, spans, target, rows)


def measured_parts(
    recordings: tuple[Recording, ...], spans: tuple[slice, ...], target: str, rows: tuple[NDArray[np.bool_], ...]
) -> list[Stretch]:
    """The same of references that were measured at all, of what is moved by hand, on wheels or in flight.

    One without noise loses the motion too. Of a table that goes from rate to rate all that tells a skew, a hold or a
    play lies in brief ramps, and looks like it.
    """
    channels = [next((r.channels[name] for name in order(r)), None) for r in recordings]
    if not target.startswith("gyro") or not all(c is not None and c.source == "encoder" for c in channels):
        return []
    parts = stretches(recordings, spans, target, rows)
    return [] if any(_holds(one.input(0.0)) for one in parts) else parts


def _holds(u: Floats) -> bool:
    """Whether a rate, shape (n,), holds much of the time in which there is one."""
    size = np.abs(u)
    moving = size[1:] > MOVES * size.max(initial=0.0)
    steady = np.abs(np.diff(u)) < HOLDS * size.max(initial=0.0)
    return not moving.any() or float(np.mean(steady[moving])) > OFTEN


def rows_per_motion(parts: list[Stretch], found: tuple[Settled, ...]) -> int:
    """Rows of a bin that holds no faster motion than the references tell; 1 where they have no errors of their own.

    Parameters
    ----------
    parts : list of Stretch
        As `doubted` gives them.
    found : tuple of Settled
        Of each.
    """
    if not parts:
        return 1
    spectra = [_spectra(one, told.gain, told.lag) for one, told in zip(parts, found, strict=True)]
    frequency, motion, left = (np.concatenate(each) for each in zip(*spectra, strict=True))
    told = int(0.5 / (_common_bandwidth(frequency, motion, left) * parts[0].exposure.motion.dt))
    return max(told, *(one.over for one in found))


def rows_per_reading(recordings: tuple[Recording, ...]) -> int:
    """Rows of a bin that holds readings of a slow reference, 1 beside others: within one its error is one."""
    every = max((r.channels[name].every / r.dt for r in recordings for name in order(r)[:1]), default=0.0)
    return int(np.ceil(READINGS * every)) if every * recordings[0].dt > SLOW else 1


def _settled(one: Stretch) -> Settled:
    motion, found, means = one.exposure.motion, [], one
    while True:
        gain, sd, lags = fitted([means], {one.run: motion.lag}, {one.run})
        found.append((sd, gain, lags[one.run], means.over))
        means = replace(one, over=LONGER * means.over)
        # Gaps leave ever fewer of longer means.
        if means.over > min(LONGEST / motion.dt, means.known.sum() / MEANS):
            break
    least = agreeing([(over, gain, sd) for sd, gain, _, over in found])
    sd, gain, lag, _ = min(one for one in found if one[-1] >= least)
    return Settled(one.run, least, gain, lag)


def agreeing(found: list[tuple[int, float, float]]) -> int:
    """The fewest rows, of (rows, gain, its deviation) in rising order, from which on all gains agree."""
    least, *_ = found[-1]
    for k in range(len(found) - 2, -1, -1):
        rows, gain, sd = found[k]
        if any(abs(gain - other) > max(AGREE * float(np.hypot(sd, far)), SAME) for _, other, far in found[k + 1 :]):
            break
        least = rows
    return least


def shortest_agreeing(gains: Sequence[tuple[float, float, float]]) -> int:
    """Index of the shortest means from which on gains agree, of (length [s], gain, deviation) in rising order."""
    return agreeing([(k, gain, sd) for k, (_, gain, sd) in enumerate(gains)])


def doubtful(recording: Recording) -> bool:
    """Whether the reference of a recording has errors of its own: noise, or rows at which it was not read."""
    channel = next((recording.channels[name] for name in order(recording)), None)
    if channel is None or channel.source != "encoder":
        return False
    noisy = recording.table is not None and not recording.table.still
    return noisy or channel.every > 0


def _common_bandwidth(frequency: Floats, motion: Floats, left: Floats) -> float:
    """The frequency up to which modes are taken [Hz], of the powers of the motion and of what is left in each mode."""
    by = np.argsort(frequency)
    frequency, motion, left = frequency[by], motion[by], left[by]
    told, n, total, start, bands = 0.0, 0, 0.0, 0, []
    while start < len(frequency):
        stop = max(start + FEWEST, int(np.searchsorted(frequency, RATIO * frequency[start], side="right")))
        power, rest = float(motion[start:stop].sum()), float(left[start:stop].sum())
        n += len(frequency[start:stop])
        total += len(frequency[start:stop]) * power / max(rest, 1e-300)
        last = float(frequency[min(stop, len(frequency)) - 1])
        # What is left is in the reference too, if it is its own.
        bands.append((last, max(power - rest, 0.0)))
        if n**2 <= total:
            told = last
        start = stop
    whole = np.cumsum([moved for _, moved in bands])
    return max(told, bands[int(np.searchsorted(whole, MOTION * whole[-1]))][0])


def _spectra(one: Stretch, gain: float, lag: float) -> tuple[Floats, Floats, Floats]:
    """Frequencies of a stretch's modes [Hz], the powers of its motion in them, and of what is left beside it."""
    from scipy.fft import dct  # slow to import

    motion = one.exposure.motion
    u, known = gain * one.input(lag), one.known > 0
    left = np.where(known, one.y - u - np.median((one.y - u)[known]), 0.0)
    # A few rows far off are no error of the reference; that of a table which rests half of the time is in the others.
    bound = FAR * float(np.sqrt(np.mean(left[known] ** 2)))
    left = np.clip(left, -bound, bound)
    n = len(u)
    of_motion, of_rest = dct(u, norm="ortho")[1:] ** 2, dct(left, norm="ortho")[1:] ** 2
    return np.arange(1.0, n) / (2 * n * motion.dt), of_motion, of_rest
