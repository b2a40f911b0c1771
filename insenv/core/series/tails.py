"""Logarithms of the probability beyond a value, of Student's t and of Fisher's F.

    log P(T > t), t on nu degrees of freedom        log P(F > x), x on d and nu degrees

from the functions of `scipy.special` themselves: the distributions of `scipy.stats` check and broadcast for a hundred
times as long as they compute, and take a second to import. Below the middle a tail is nearly one, and its logarithm
comes from the other side.
"""

from __future__ import annotations

import numpy as np
from scipy.special import fdtr, fdtrc, stdtr

from insenv.core.recording import Floats


def log_tails_of_t(t: Floats, freedom: float) -> Floats:
    """Log of the probability that Student's t exceeds each of ``t``; -inf where that is below the smallest number."""
    return _log(stdtr(freedom, -t), stdtr(freedom, t))


def log_tails_of_f(x: Floats, gained: float, freedom: float) -> Floats:
    """Log of the probability that Fisher's F on ``gained`` and ``freedom`` degrees exceeds each of ``x``."""
    return _log(fdtrc(gained, freedom, x), fdtr(gained, freedom, x))


def log_tail_of_t(t: float, freedom: float) -> float:
    """The same of one value."""
    return float(log_tails_of_t(np.asarray(t), freedom))


def log_tail_of_f(x: float, gained: float, freedom: float) -> float:
    """The same of one value."""
    return float(log_tails_of_f(np.asarray(x), gained, freedom))


def _log(above: Floats, below: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.where(above < 0.5, np.log(above), np.log1p(-np.minimum(below, 0.5)))
