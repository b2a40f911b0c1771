"""Lock-in of a ring-laser gyro.

    sign(u) sqrt(u^2 - W_L^2) - u        where u^2 > W_L^2    (nearly -W_L^2 / (2 u) at high rates)
    -u                                   within the dead zone

The parameter is c = W_L^2, in which the effect is linear at high rates; a slightly negative c, as a fit may
try, is the same formula. The difference of the square root to u is written without cancellation: sqrt(u^2 -
c) - |u| = -c / (sqrt(u^2 - c) + |u|).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import CurveEffect, Param


@final
@dataclass(frozen=True)
class LockIn(CurveEffect):
    """Two counter-propagating waves that pull each other's frequency."""

    id = "lock_in"
    # A lock-in rate of 3e-3 rad/s (650 deg/h) is one standard deviation; 0.03 rad/s the largest credible one.
    linear = (Param("W_L_squared", "rad^2/s^2", sd=1e-5, bound=1e-3, low=0.0),)
    source = "F. Aronowitz, The laser gyro, in Laser Applications 1 (1971); Adler's equation"
    instruments = ("gyro",)
    of_rate = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Departure from the true rate, shape (..., n)."""
        c = theta[..., 0, None]
        square = u * u - c
        root = np.sqrt(np.maximum(square, 0.0))
        magnitude = np.abs(u)
        total = root + magnitude
        pulled = -np.sign(u) * c / np.where(total > 0.0, total, 1.0)
        return np.where(square > 0.0, pulled, -u)

    def grid(self, motion: Motion) -> Floats:
        """One row without shapes, shape (1, 0), where there is any rate; no row, shape (0, 0), elsewhere."""
        return np.empty((1 if np.any(motion.rate) else 0, 0))
