r"""What the next piece of a procedure is expected to tell, and what it costs: the rules of policies that look ahead.

    gain = ln(sd_now / sd_then) / seconds          [nat/s]

sd_then is what will be known after the piece. In a linear Gaussian model it follows from the regressors of the motion
and from the noise, not from what will be read. A greedy policy looks at one piece; a receding horizon looks at
sequences of pieces, runs the first of the best one, and then thinks again with what was done and read meanwhile.
Either stops once the demanded deviation is reached, or where the best gain is below the price of a second.

Source: V. V. Fedorov, Theory of Optimal Experiments (1972); A. Atkinson, A. Donev, R. Tobias, Optimum Experimental
Designs, with SAS (2007).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats


@dataclass(frozen=True)
class Aim:
    """When it is enough.

    Attributes
    ----------
    demanded : float
        Deviation that is wanted, in the unit of the quantity; 0: as small as the time allows.
    price : float
        Of a second [nat/s]; 0: time costs nothing.

    Raises
    ------
    InputError
        If one of them is negative or no number.
    """

    demanded: float
    price: float = 0.0

    def __post_init__(self) -> None:
        if not (self.demanded >= 0 and self.price >= 0):
            raise InputError(f"demanded {self.demanded:g} and price {self.price:g} given; wanted zero or more of each")

    def reached(self, sd: Floats, best: Floats | float = np.inf) -> NDArray[np.bool_]:
        """Whether to stop, with the deviation that is told and the largest gain that is expected, shape (...)."""
        return np.asarray((sd <= self.demanded) | (np.asarray(best) < self.price))


def gain(now: Floats, then: Floats, seconds: Floats) -> Floats:
    """Expected information by the second [nat/s]: deviations before, after, and the time, shapes that broadcast."""
    found: Floats = np.log(now / then) / seconds
    return found


def sequences(pieces: int, changes: int) -> Floats:
    """Signs of so many pieces with that many changes at most, shape (s, pieces).

    The simple ones come first, so that of equal sequences the one with fewer changes is taken.
    """
    found = []
    for count in range(changes + 1):
        for cuts in combinations(range(1, pieces), count):
            signs = (-1.0) ** np.searchsorted(np.array(cuts), np.arange(pieces), side="right")
            found += [signs, -signs]
    return np.array(found)
