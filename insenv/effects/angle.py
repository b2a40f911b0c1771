"""Errors that repeat with the table's angle a, known at the edges of the intervals.

    encoder_harmonic    projection d/dt [c cos(n a) + s sin(n a)]     the reference is wrong
    angle_locked_rate   c cos(n a) + s sin(n a)                       magnetic field, heat source, tilt
    earth_rate          c cos a + s sin a                             horizontal part of the Earth's rate

The mean of a derivative is the difference over the edges, exact for any motion; the mean of a harmonic takes
an angle that turns evenly over an interval. ``angle_locked_rate`` of order 1 and ``earth_rate`` are one
curve: only their credible size differs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion, interval_slope
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, LinearEffect, Param
from insenv.effects.forms import checked_order, columns, harmonic, known

#: Highest harmonic of a turn that can be asked for; gears and pole pairs stay below.
HIGHEST_ORDER = 360


@final
@dataclass(frozen=True)
class EncoderHarmonic(LinearEffect):
    """An encoder that is wrong by c cos(n a) + s sin(n a): eccentricity (n = 1), ellipticity (n = 2), ..."""

    order: int = 1

    id = "encoder_harmonic"
    linear = (Param("c", "rad", sd=1e-4, bound=1e-2), Param("s", "rad", sd=1e-4, bound=1e-2))
    needs = ("angle",)
    source = "Sensors 13 (2013) 2750: encoder harmonics on a rate table"
    instruments = ("gyro",)

    def __post_init__(self) -> None:
        checked_order(self.id, self.order, HIGHEST_ORDER)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Differences of the harmonics over the edges, shape (..., n, 2)."""
        phase = self.order * known(motion, "angle", self.id)
        means = [interval_slope(wave(phase), motion.dt) * motion.projection for wave in (np.cos, np.sin)]
        return columns(u, *means)


@final
@dataclass(frozen=True)
class AngleLockedRate(LinearEffect):
    """A rate that depends on where the table points."""

    order: int = 1

    id = "angle_locked_rate"
    linear = (Param("c", OUTPUT, sd=1e-3, bound=0.1), Param("s", OUTPUT, sd=1e-3, bound=0.1))
    needs = ("angle",)
    source = "IEEE Std 952-1997: magnetic sensitivity; Sensors 13 (2013) 2750: wobble of the table's axis"
    instruments = ("gyro",)

    def __post_init__(self) -> None:
        checked_order(self.id, self.order, HIGHEST_ORDER)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Means of the harmonics, shape (..., n, 2)."""
        return columns(u, *harmonic(known(motion, "angle", self.id), self.order))


@final
@dataclass(frozen=True)
class EarthRate(LinearEffect):
    """Horizontal part of the Earth's rate, in a direction that nobody declared.

    The vertical part follows from latitude and tilt: it belongs to the true rate of `Motion`, not here.
    """

    id = "earth_rate"
    # No horizontal part is larger than the whole.
    linear = tuple(Param(name, OUTPUT, sd=EARTH_RATE, bound=EARTH_RATE) for name in ("c", "s"))
    needs = ("angle",)
    source = "Rate of rotation: WGS 84 (insenv.core.earth)"
    instruments = ("gyro",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Means of cosine and sine of the table angle, shape (..., n, 2)."""
        return columns(u, *harmonic(known(motion, "angle", self.id), 1))
