"""Logarithms of the probability beyond a value, of Student's t, of Fisher's F and of sums of exponentials.

    log P(T > t), t on nu degrees of freedom        log P(F > x), x on d and nu degrees        log P(G > x), G of k

from the functions of `scipy.special` themselves: the distributions of `scipy.stats` check and broadcast for a hundred
times as long as they compute, and take a second to import. Below the middle a tail is nearly one, and its logarithm
comes from the other side. Where one is below the smallest number, the first term of the hypergeometric series of the
incomplete beta function, or of the gamma function's continued fraction, goes on (NIST Digital Library of Mathematical
Functions, 8.17.8 and 8.11.2).
"""

from __future__ import annotations

import numpy as np
from scipy.special import betaln, fdtr, fdtrc, gammaincc, gammaln, stdtr

from insenv.core.recording import Floats

#: Probability below which the first term of a series stands for it.
TINY = 1e-290


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


def log_far_tails_of_f(x: Floats, gained: Floats, freedom: Floats) -> Floats:
    """Log of the probability that Fisher's F exceeds each of ``x``, however far, all of one shape."""
    tail = fdtrc(gained, freedom, x)
    a, b = 0.5 * freedom, 0.5 * gained
    z = freedom / (freedom + gained * np.maximum(x, 1e-300))
    first = a * np.log(z) + b * np.log1p(-np.minimum(z, 1 - 1e-16)) - np.log(a) - betaln(a, b)
    far = first - np.log1p(-np.minimum((a + b) * z / (a + 1), 0.99))
    return _onward(tail, far)


def log_far_tails_of_sums(x: Floats, count: int) -> Floats:
    """Log of the probability that a sum of ``count`` exponentials of mean one exceeds each of ``x``, however far."""
    tail = gammaincc(count, x)
    beyond = np.maximum(x, count)
    first = (count - 1) * np.log(beyond) - beyond - gammaln(count)
    far = first - np.log1p(-np.minimum((count - 1) / beyond, 0.99))
    return _onward(tail, far)


def _onward(tail: Floats, far: Floats) -> Floats:
    """Log of a ``tail``; what a series says of it, ``far``, where it is too small to be told."""
    return np.where(tail > TINY, np.log(np.maximum(tail, TINY)), np.minimum(far, np.log(TINY)))


def _log(above: Floats, below: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.where(above < 0.5, np.log(above), np.log1p(-np.minimum(below, 0.5)))
