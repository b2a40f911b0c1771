r"""Lines at a few times the frequency at which a motion repeats.

What a law of the motion makes that no effect has (a supply that sags as the motor pulls, a cable that is bent) repeats
as the motion does: with P the period of u or of \|u\|,

    f = k / P,      k = 1, 2, ...

of which a line at one k is the first that stands out. The period is the first lag at which u, beside its mean, is
itself again.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from insenv.core.recording import Floats
from insenv.identify.fit.problem import Problem
from insenv.identify.prepare.spectral.lines import multiple

#: Correlation from which on a motion is itself again, as often as is asked, and that it must have lost before; fewest
#: periods. Moves of other angles on one beat have 0.7.
AGAIN, LOST, FEWEST, ASKED = 0.6, 0.4, 6, 4
#: Most lines of a period; how near one must be, in widths 1 / duration.
MOST, WITHIN = 12, 0.5


def each_cycle(problem: Problem, frequency: float) -> int:
    """Times in a period of the motion that a line at ``frequency`` [Hz] comes; 0 where it does not go with it."""
    found: tuple[tuple[float, float], ...] = problem.remember("cycles", lambda: tuple(_cycles(problem)))
    return next((k for seconds, span in found if (k := multiple(frequency, 1 / seconds, MOST, WITHIN / span))), 0)


def _cycles(problem: Problem) -> Iterator[tuple[float, float]]:
    """Periods of the motion and of its size in each run, and the time in which they are told [s]."""
    if not problem.turns:
        return
    u, width = problem.bins.mean(tuple(e.u for e in problem.exposures)), problem.bins.width
    for run in dict.fromkeys(block.run for block in problem.fitted):
        block = max((b for b in problem.fitted if b.run == run), key=lambda b: b.n)
        own = u[block.start : block.stop]
        found = (period(motion) * width for motion in (own, np.abs(own)))
        yield from ((seconds, block.n * width) for seconds in found if seconds)


def period(motion: Floats) -> float:
    """Bins after which a motion is itself again, as nearly as all its periods tell; 0 where it does not repeat."""
    n, left = len(motion), motion - motion.mean()
    if n < 2 * FEWEST or not np.any(left):
        return 0.0
    longest = n - n // FEWEST
    # As `scipy.signal.correlate`, which takes longer to import than all that the loop needs besides.
    size = next_fast_len(2 * n - 1, real=True)
    both = irfft(rfft(left, size) * rfft(left[::-1], size), size)[n - 1 : n - 1 + longest]
    power = np.cumsum(left**2)
    lag = np.arange(longest)
    energy = np.sqrt(power[n - 1 - lag] * (power[-1] - np.append(0.0, power)[lag]))
    alike = both / np.maximum(energy, 1e-300)
    lost = int(np.argmax(alike < LOST))
    again = lost + int(np.argmax(alike[lost:] > AGAIN))
    if alike[lost] >= LOST or alike[again] <= AGAIN:
        return 0.0
    stop = again + int(np.argmax(alike[again:] < AGAIN))  # the first stretch of lags at which it is
    found = float(again + np.argmax(alike[again : max(stop, again + 1)]))
    if found * FEWEST > n or any(alike[round(k * found)] < AGAIN for k in range(1, ASKED)):
        return 0.0
    return _by_all(alike, found)


def _by_all(alike: Floats, first: float) -> float:
    """A period by the lags at which the motion is itself again: each foretells the next."""
    found = first
    for k in range(2, len(alike)):
        near = round(k * found)
        low, high = near - int(found / 4), near + int(found / 4) + 1
        if high >= len(alike):
            break
        found = (low + int(np.argmax(alike[low:high]))) / k
    return found
