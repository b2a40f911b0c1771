r"""Whether what is left at a frequency goes with what a measured reference has there.

At a rate that changes a ripple of the motor is no line, and a filter or a lag of the reference leaves some of it. Of
the waves a_k of the residual and b_k of the reference in short windows the coherence says so,

    g = |sum a_k b_k*|^2 / (sum |a_k|^2 sum |b_k|^2),      P(g > x) = (1 - x)^(K - 1)

where neither knows of the other, K = (sum |a_k|^2)^2 / sum |a_k|^4 being how many windows count, or the same of b_k,
both waves over the root of their own and the median square, or one reversal would be all.
Waves in raised cosines that overlap by half are 1/6 alike, which is as good as independent.

Source: J. S. Bendat, A. G. Piersol, Random Data, 4th ed., Wiley 2010, 9.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats

#: Cycles of a line and least values in a window; windows that overlap.
CYCLES, WINDOW, OVERLAP = 8.0, 16, 2
#: Coherence from which on one follows the other, and the probability that it does by chance.
COHERENT, BY_CHANCE = 0.3, 1e-3


def follows(stretches: Sequence[tuple[Floats, Floats]], cycles: float) -> bool:
    """Whether what is left follows the reference about a frequency.

    Parameters
    ----------
    stretches : sequence of (left, reference), each of shape (n,)
        Of values at equal steps.
    cycles : float
        Of the line, from one value to the next.
    """
    own, other = (_tamed(np.concatenate([_in_windows(s[k], cycles) for s in stretches])) for k in (0, 1))
    power, of_other = np.abs(own) ** 2, np.abs(other) ** 2
    if not power.any() or not of_other.any():
        return False
    coherence = min(float(abs(np.vdot(own, other)) ** 2 / (power.sum() * of_other.sum())), 1.0)
    windows = min(float(p.sum() ** 2 / (p @ p)) for p in (power, of_other))
    return coherence > COHERENT and (1 - coherence) ** (windows - 1) < BY_CHANCE


def _tamed(waves: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Waves of which the loudest count little more than others: where a table reverses, one window has all of that."""
    size = np.abs(waves)
    return np.asarray(waves / np.maximum(np.hypot(size, np.median(size) if len(size) else 0.0), 1e-300))


def _in_windows(values: Floats, cycles: float) -> NDArray[np.complex128]:
    """Waves of so many ``cycles`` a value, in windows of which each has its own straight line and bend."""
    n = max(WINDOW, int(np.ceil(CYCLES / cycles)))
    if len(values) < n:
        return np.zeros(0, np.complex128)
    windows = np.lib.stride_tricks.sliding_window_view(values, n)[:: n // OVERLAP]
    slow = np.linalg.qr(np.vander(np.linspace(-1, 1, n), 3))[0]
    taper = np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    return np.asarray((windows - (windows @ slow) @ slow.T) @ (taper * np.exp(-2j * np.pi * cycles * np.arange(n))))
