"""Whether what is said to be at rest moves: means over a second that no bias and no sway explains.

A gyro at rest reads its bias and the Earth's rate, an accelerometer its share of gravity. A unit that was turned,
driven or tipped leaves the median of the recording by more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.core.series.robust import MEDIAN
from insenv.core.series.stretches import stretches
from insenv.core.units import DEG

#: Departure of a second's mean from the median that is a turn [rad/s], and that is another attitude [m/s^2].
TURNING, TIPPED = 5 * DEG, 1.5
#: Robust deviations of the means at rest from which the beginning and the end of a turn are seen.
SEEN = 4.5
#: Deviations of a mean by the white noise of its samples that are no motion.
NOISE = 6.0
#: Length of the means [s], and of what is left out beside them.
SECOND, BESIDE = 1.0, 2.0
#: Fewest rows of a mean, so that noise is no motion.
FEWEST = 4
#: Least share of the rows that must be at rest.
LEAST_REST = 0.3
#: A second of a rest scatters by no more than this [rad/s, m/s^2], nor by so many times what the quietest do.
STEADY, CALM, QUIETER = 2 * DEG, 0.5, 3.0
#: Share of the seconds that are the quietest, and the shortest rest that is worth a fit [s].
QUIETEST, WORTH = 0.1, 10.0


def rows_of_a_second(dt: float) -> int:
    """Rows of the means that are looked at."""
    return max(FEWEST, int(round(SECOND / dt)))


def departs(values: Floats, dt: float, limit: float, used: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
    """Rows in which a channel departs from its median by more than ``limit``, and those beside them, shape (rows,).

    The median is that of the rows ``used``, by default of all.
    """
    used = np.ones(len(values), bool) if used is None else used
    rows = rows_of_a_second(dt)
    if len(values) < 3 * rows:
        return np.zeros(len(values), bool)
    starts = np.arange(0, len(values), rows)
    means = np.add.reduceat(values, starts) / np.diff(np.append(starts, len(values)))
    away = np.abs(means - np.median(values[used]))
    # White noise of the samples moves their means as well, and is no motion.
    steps = np.abs(np.diff(values))[used[1:] & used[:-1]]
    white = float(np.median(steps)) / MEDIAN / np.sqrt(2 * rows) if len(steps) else 0.0
    limit = max(limit, NOISE * white)
    # What has begun as a turn goes on until nothing of it is seen any more.
    own = np.logical_or.reduceat(used, starts)
    turned = away > limit
    moves = np.zeros(len(away), bool)
    for start, stop in stretches(turned | (away > SEEN * np.median(away[own]))):
        moves[start:stop] = turned[start:stop].any()
    beside = int(np.ceil(BESIDE / dt / rows))
    wide = np.convolve(moves, np.ones(2 * beside + 1), "same") > 0.5
    return np.repeat(wide, rows)[: len(values)]


def longest_rest(gyros: Sequence[Floats], accels: Sequence[Floats], dt: float) -> tuple[int, int] | None:
    """Rows ``[start, stop)`` of the longest stretch in which all channels are quiet; None if below `WORTH`."""
    rows = rows_of_a_second(dt)
    count = len((*gyros, *accels)[0]) // rows
    quiet = np.ones(count, bool)
    for values, most in (*((g, STEADY) for g in gyros), *((a, CALM) for a in accels)):
        scatter = values[: count * rows].reshape(count, rows).std(axis=1)
        quiet &= scatter <= min(most, QUIETER * float(np.quantile(scatter, QUIETEST)))
    longest = max(stretches(quiet), key=lambda one: one[1] - one[0], default=(0, 0))
    start, stop = longest[0] * rows, longest[1] * rows
    means = [v[start:stop].reshape(-1, rows).mean(axis=1) for v in (*gyros, *accels)] if stop > start else []
    limits = (*(TURNING for _ in gyros), *(TIPPED for _ in accels))
    steady = all(np.ptp(m) < limit for m, limit in zip(means, limits, strict=False))
    return (start, stop) if (stop - start) * dt >= WORTH and steady else None
