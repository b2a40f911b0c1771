"""The step to which values were rounded: by a counter, a converter, or the digits of a text file.

The differences of rounded values differ by multiples of one step q. A difference of two of them is wrong by up to q,
however small the noise is: nothing within that is an outlier.
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats

#: How far from a multiple of the step a difference may be, as a share of it.
OFF = 0.02
#: Steps of floating-point numbers below which a difference is nothing.
EPSILONS = 16.0


def rounding(values: Floats) -> float:
    """The step to which ``values``, shape (n,), were rounded; that of floating-point numbers where they were not."""
    least = EPSILONS * float(np.spacing(np.abs(values).max(initial=0.0)))
    steps = np.diff(values)
    between = np.diff(np.sort(steps))
    between = between[between > least]
    if not len(between):
        return least
    # The smallest one is the step if all are multiples of it; large multiples, known to a share of one, are not asked.
    multiples = between / between.min()
    multiples = multiples[multiples * least < OFF * between.min()]
    whole = len(multiples) > 0 and float(np.abs(multiples - np.rint(multiples)).max()) < OFF
    return float(np.median(between / np.rint(between / between.min()))) if whole else least
