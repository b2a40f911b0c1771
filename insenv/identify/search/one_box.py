r"""Drifts of one box: weak on each axis, certain on all of them together.

What warms up is the box: its axes drift at the same time, with one time constant, each by an amount of its own, while
their random walks know nothing of each other, and noise does not jump on several axes at once. With z the deviates of
one drift on n channels, the largest m of them give

    Z = (z_1 + ... + z_m) / sqrt(m),        p = (n over m) looks P(N > Z)

where the binomial coefficient pays for the choice of channels. On 134 pieces of 600 s of seven units at rest z of a
straight drift had a mean of -0.11 and a standard deviation of 1.00.

Source: S. A. Stouffer et al., The American Soldier (1949), vol. 1, p. 45 (sum of deviates).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from insenv.identify.clean.settling import only_time
from insenv.identify.fit.evidence import log_tail
from insenv.identify.search.round import against
from insenv.identify.search.scan import Hit
from insenv.identify.search.tracks import Track

#: What a box does as a whole; each axis by its own amount.
DRIFTS = ("bias_drift", "bias_warm_up")
#: Deviate of an axis' own evidence without which it has no part in it: one in twenty by chance.
LEAST = 1.64
#: Deviate from which on an axis of a box that drifts is not said to be still.
DOUBT = 1.0


def may_drift(track: Track) -> bool:
    """Whether nothing but time is at work on the one run that was fitted."""
    return only_time(track.problem) and len({b.run for b in track.problem.fitted}) == 1


def looks_of(track: Track, hit: Hit) -> float:
    """Looks of a hit without the odds against events, which one channel has."""
    return hit.looks / against(track.problem, hit.candidate.effect)


def log_p_together(deviates: Sequence[float], looks: float, channels: int) -> float:
    """Logarithm of the p-value of one drift on some of so many channels, chosen by these deviates."""
    total = sum(deviates) / math.sqrt(len(deviates))
    return min(0.0, log_tail(total) + math.log(looks * math.comb(channels, len(deviates))))


def surest(deviates: Sequence[float], looks: float) -> float:
    """Logarithm of the smallest p-value of one drift on any two or more of the channels; 0 where there are fewer.

    Parameters
    ----------
    deviates : sequence of float
        Of all channels.
    looks : float
    """
    own = sorted((z for z in deviates if z >= LEAST), reverse=True)
    return min((log_p_together(own[:m], looks, len(deviates)) for m in range(2, len(own) + 1)), default=0.0)
