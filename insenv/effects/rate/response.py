r"""Response of an open-loop fibre-optic gyro to the input rate u, and what a compensation leaves of it.

    sine_response         c (sin(K_s u) / K_s - u)
    compensation_ripple   c sin(m arcsin(u / u_m)),    u clipped to plus and minus u_m

The Sagnac phase is K_s u, with K_s = 2 pi L D / (lambda c) of coil length L and diameter D; a gyro that puts out the
sine of it has c = 1, one that is compensated less. A polynomial fit over the full range u_m leaves a remainder that
swings between equal extremes: for odd m it is the Chebyshev polynomial of that degree, but for its sign.

What is not linear in u takes the mean rate for the rate: exact where the rate is constant over an interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin
from typing import final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, CurveEffect, Param
from insenv.effects.rate.scale import LEAST_RATE, rates_run

#: Ranges of a compensation, in largest rates of the recording, and degrees that a scan tries.
RANGES, DEGREES = (1.0, 1.05, 1.15, 1.4, 2.0), tuple(float(m) for m in range(3, 17))
#: Phase at the largest rate [rad] below which a ripple is a cubic, or little more: that of degree 3 is one.
LEAST_PHASE = 7.0
#: Magnitudes of the rate that tell a ripple: twice its parameters and the scale factor; what counts as one of them, as
#: a share of the largest.
LEAST_LEVELS, LEVEL = 8, 0.02


@final
@dataclass(frozen=True)
class SineResponse(CurveEffect):
    """An output that follows the sine of the Sagnac phase.

    For simulation: within a usual range it is the curve of ``scale_factor_cubic``.
    """

    id = "sine_response"
    title = "sine response"
    meaning = "an open loop puts out the sine of the phase, not the phase"
    linear = (Param("c", "1", sd=0.5, bound=2.0),)
    shapes = (Param("K_s", "s", sd=0.1, low=1e-3),)
    source = "H. C. Lefevre, The Fiber-Optic Gyroscope (2014): Sagnac phase, open-loop response"
    instruments = ("gyro",)
    of_rate = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Departure from the true rate, shape (..., n)."""
        share, scale = theta[..., 0, None], theta[..., 1, None]
        return share * (np.sin(scale * u) / scale - u)

    def grid(self, motion: Motion) -> Floats:
        """Sagnac scales at which the largest rate makes a phase of 0.1 to 1.5 rad, shape (g, 1)."""
        largest = float(np.abs(motion.rate).max(initial=0.0))
        return np.geomspace(0.1, 1.5, 5)[:, None] / largest if largest else np.empty((0, 1))


@final
@dataclass(frozen=True)
class CompensationRipple(CurveEffect):
    """What the compensation of a response leaves: a ripple of equal height over the full range.

    A search tries it where a recording has many rates. A test over a small part of the range shows a cubic.
    """

    id = "compensation_ripple"
    title = "ripple of the compensation"
    meaning = "what a compensation leaves of a curved response swings over the range of rates"
    linear = (Param("c", OUTPUT, sd=0.01, bound=0.02, per_rate=True),)
    shapes = (Param("m", "1", sd=1.0, low=1.0), Param("u_m", OUTPUT, sd=1.0, low=1e-2))
    becomes = ("scale_factor_cubic",)
    unusual = True
    source = "T. J. Rivlin, Chebyshev Polynomials (1990): remainder of the best polynomial fit"
    instruments = ("gyro",)
    of_rate = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """The ripple, shape (..., n)."""
        height, degree, full = (theta[..., j, None] for j in range(3))
        return height * np.sin(degree * np.arcsin(np.clip(u / full, -1.0, 1.0)))

    def grid(self, motion: Motion) -> Floats:
        """Degrees and ranges, shape (g, 2), where the recording has many rates and shows more than a cubic."""
        largest = float(np.abs(motion.rate).max(initial=0.0))
        if largest < LEAST_RATE or levels(motion.rate, largest) < LEAST_LEVELS:
            return np.empty((0, 2))
        return np.array(
            [(m, share * largest) for share in RANGES for m in DEGREES if m * asin(1 / share) > LEAST_PHASE]
        )


def levels(rate: Floats, largest: float) -> int:
    """Magnitudes of the rate that were run, zero not counted and those within a fiftieth of the largest as one."""
    which, _ = rates_run(np.abs(rate).ravel(), LEVEL * largest)
    return int(np.count_nonzero(which))
