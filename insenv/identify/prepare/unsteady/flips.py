r"""Rows that go to and fro between two levels faster than means do: popcorn noise, a relay, a mode that flips.

In means over 1, 4, 16, ... rows, as long as they are shorter than those that are judged, the likeliest chain of two
levels with white noise about them (`insenv.identify.prepare.two_levels`) is compared with Gaussian noise of any
spectrum,

    log L_chain - log L_Gauss,        log L_Gauss = -n/2 (1 + log 2 pi s^2),

s^2 what the L values before each do not foretell of it (Yule and Walker). Levels that flip make the distribution of
values flatter than a Gaussian one, or lean: others are not asked. A chain stands for no tails and no rounding where it
stays at both levels for some means, and these are far from each other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from insenv.core.recording import Floats
from insenv.core.series.robust import robust_deviation
from insenv.identify.prepare.two_levels import TwoLevels, two_levels
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft, foretelling

#: Rows of a mean, each time as many more; means about one that show its level; means that are asked, and fewest.
LONGER, ABOUT, ASKED, FEWEST = 4, 64, 1024, 200
#: How flat or lean values are, in deviations of both by chance and at least; robust deviations to which tails are cut.
DEVIATIONS, FLAT, LEANS, TAILS = 5.0, 0.15, 0.15, 4.0
#: Log odds over Gaussian noise that are no chance, fewest changes and share of the means at either level.
ODDS, CHANGES, SHARE = 16.0, 10, 0.1
#: Means for which a level lasts at least, in the mean; how far apart levels are beside their noise, and in steps.
LASTS, APART, STEPS = 4.0, 1.5, 1.5


@dataclass(frozen=True)
class Flips:
    """Two levels of the rows: how far ``apart``, by their noise in means over ``seconds``, and changes a second."""

    log_odds: float
    apart: float
    spread: float
    rate: float
    seconds: float


def flips(left: RowsLeft, width: float) -> Flips | None:
    """The levels of rows whose means over ``width`` [s] are judged; None where they are not two."""
    return max(_found(left, width), key=lambda one: one.log_odds, default=None)


def _found(left: RowsLeft, width: float) -> Iterator[Flips]:
    rows = 1
    while rows * left.dt < width and len(left.values) >= FEWEST * rows:
        count = len(left.values) // rows
        means = left.values[: count * rows].reshape(count, rows).mean(axis=1)
        if _is_no_gaussian(means):
            part = means[:ASKED]
            chain = two_levels(part)
            log_odds = chain.loglik - _log_of_gaussian(part)
            if log_odds > ODDS and _is_a_chain(chain, len(part)) and chain.apart > STEPS * left.step:
                rate = chain.changes / (len(part) * rows * left.dt)
                yield Flips(log_odds, chain.apart, chain.spread, rate, rows * left.dt)
        rows *= LONGER


def _is_no_gaussian(means: Floats) -> bool:
    """Whether values less their local level are flatter than Gaussian ones, or lean to one side."""
    off = means - uniform_filter1d(means, min(ABOUT, len(means)))
    most = TAILS * robust_deviation(off)
    if not most > 0:
        return False
    off = np.clip(off, -most, most)
    square, n = off**2, len(off)
    variance = float(square.mean())
    flat, leans = 3 - float((square**2).mean()) / variance**2, abs(float((square * off).mean())) / variance**1.5
    return flat > max(FLAT, DEVIATIONS * math.sqrt(24 / n)) or leans > max(LEANS, DEVIATIONS * math.sqrt(6 / n))


def _log_of_gaussian(values: Floats) -> float:
    """Log-likelihood of values as Gaussian noise of any spectrum."""
    off = values - values.mean()
    taps = foretelling(off)
    left = off if taps is None else np.convolve(off, taps, "valid")
    spread = float(np.mean(left**2))
    return -0.5 * len(values) * (1 + math.log(2 * math.pi * max(spread, 1e-300)))


def _is_a_chain(chain: TwoLevels, n: int) -> bool:
    """Whether it stays at either level, often goes to the other, and these are apart."""
    lasts = n / max(chain.changes, 1)
    return (
        chain.changes >= CHANGES
        and lasts >= LASTS
        and SHARE <= chain.share <= 1 - SHARE
        and chain.apart > APART * chain.spread
    )
