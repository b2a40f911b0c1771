r"""How finely a vehicle's motion is resolved: pieces of time, and the polynomial that stands for each.

Over a piece of length H a sine of angular frequency w has the phase x = w H / 2 on either side of the middle. What n
Chebyshev nodes leave of it is about 2 (x/2)^n / n! of its amplitude (Trefethen, Approximation Theory and Approximation
Practice, SIAM 2013, section 8), and D terms of the Taylor series about the middle leave x^D / D!.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import count
from math import factorial

import numpy as np

from insenv.core.recording import Floats

#: Longest piece [s], and the largest phase of sway, of a turn and of settling in half a piece [rad].
LONGEST, SWAY, OTHERS = 1.0, 2.5, 1.0
#: What is left of a second harmonic, and what the series of the sway leaves of its amplitude.
_HARMONIC, _SERIES = 1e-7, 1e-17


@dataclass(frozen=True)
class Rule:
    """Pieces begin at whole multiples of ``length`` [s], on the clock of the run.

    ``nodes`` (n,), an even number, are in (-1, 1); ``transform`` (n, n) makes Chebyshev coefficients of the values
    there; the sway's series has ``terms`` terms.
    """

    length: float
    nodes: Floats
    transform: Floats
    terms: int


@lru_cache(64)
def rule(sway: float, others: float) -> Rule:
    """The rule for sway no faster than ``sway`` and for other motion no faster than ``others`` [rad/s]."""
    wanted = min(LONGEST, 2 * SWAY / max(sway, 1e-9), 2 * OTHERS / max(others, 1e-9))
    # Round lengths: their ends are ends of sampling intervals too.
    power = 10.0 ** np.floor(np.log10(wanted) + 1e-9)
    length = float(power * max(m for m in (1, 2, 5) if m * power <= wanted * (1 + 1e-9)))
    phase = max(sway, others) * length / 2
    n = next(n for n in count(8, 2) if 2 * phase**n / factorial(n) < _HARMONIC)
    terms = next(d for d in count(4) if phase**d / factorial(d) < _SERIES)
    angle = np.pi * (np.arange(n) + 0.5) / n
    transform = 2 / n * np.cos(np.arange(n)[:, None] * angle)
    transform[0] /= 2
    return Rule(length, np.cos(angle), transform, terms + terms % 2)
