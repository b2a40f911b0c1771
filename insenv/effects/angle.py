"""Errors that repeat with the table's angle a, known at the edges of the intervals.

    encoder_harmonic    projection d/dt [c cos(n a) + s sin(n a)]     the reference is wrong
    angle_locked_rate   c cos(n a) + s sin(n a)                       a magnet or heat source on the base, tilt
    magnetic_field      c cos(a - b) + s sin(a - b)                   the place's field, b how far the base was turned
    earth_rate          c cos a + s sin a                             horizontal part of the Earth's rate
    table_tilt          g (c cos a + s sin a)                         gravity on an accelerometer, the axis not plumb

All are one wave c cos(n a) + s sin(n a), or its derivative: with theta for c and s it is what is added, with (1, 0)
and (0, 1) it is the regressors. The mean of a derivative is the difference over the edges, exact for any motion; the
mean of a harmonic takes a rate that changes evenly over an interval, to first order in that change.
``angle_locked_rate`` of order 1 and ``earth_rate`` are one curve: only their credible size differs.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self, final

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion, interval_slope
from insenv.core.recording import Floats
from insenv.core.units import STANDARD_GRAVITY
from insenv.effects.base import OUTPUT, Effect, Instrument, LinearEffect, Param
from insenv.effects.forms import SET, checked_order, columns, known, spread, wave_at
from insenv.effects.wobble import HIGHEST_ORDER as HIGHEST_WOBBLE
from insenv.effects.wobble import Wobble

#: Highest harmonic of a turn that can be asked for; gears and pole pairs stay below.
HIGHEST_ORDER = 360
#: How well the tilt of a mount is taken to be known, in radians: 0.17 deg.
MOUNTED = 0.003
#: Departure of the share of the table's rate that an axis sees from none and all, up to which a wobble shows nothing.
LEAST_SHARE = 1e-3


class _Wave(LinearEffect):
    """A wave of the table angle, with the coefficients c and s."""

    needs = ("angle",)
    instruments: ClassVar[tuple[Instrument, ...]] = ("gyro",)

    @abstractmethod
    def wave(self, motion: Motion, c: float | Floats, s: float | Floats) -> Floats:
        """Mean of the wave over each interval, shape (..., n), for numbers or coefficients of shape (..., 1)."""

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """The wave of c = 1 and that of s = 1, shape (..., n, 2)."""
        return columns(u, self.wave(motion, 1.0, 0.0), self.wave(motion, 0.0, 1.0))

    def apply(
        self, u: Floats, motion: Motion, theta: Floats, state: Any = None, z: Floats | None = None
    ) -> tuple[Floats, Any]:
        """The wave of both coefficients at once: half as many cosines as by its regressors."""
        return spread(u, self.wave(motion, theta[..., 0, None], theta[..., 1, None])), state


@final
@dataclass(frozen=True)
class EncoderHarmonic(_Wave):
    """An encoder that reads too little by c cos(n a) + s sin(n a): eccentricity (n = 1), ellipticity (n = 2), ..."""

    order: int = 1

    id = "encoder_harmonic"
    title = "encoder harmonic"
    meaning = "the reference is wrong: the table's encoder repeats an angle error every turn"
    linear = (Param("c", "rad", sd=1e-4, bound=0.1), Param("s", "rad", sd=1e-4, bound=0.1))
    source = "Sensors 13 (2013) 2750: encoder harmonics on a rate table"
    hides = "encoder"
    belongs = "reference"

    def __post_init__(self) -> None:
        checked_order(self.id, self.order, HIGHEST_ORDER)

    def twins(self, motion: Motion) -> tuple[Effect, ...]:
        """Wobbles that go round once more or less often in a turn, to a gyro that is not along the table's axis."""
        inclined = LEAST_SHARE < abs(motion.projection) < 1 - LEAST_SHARE
        orders = [k for k in (self.order + 1, self.order - 1) if 1 <= k <= HIGHEST_WOBBLE]
        return tuple(Wobble(k) for k in orders) if inclined else ()

    def blind(self, motion: Motion) -> str:
        """Nothing of it is in a rest."""
        return SET if motion.stands else ""

    def wave(self, motion: Motion, c: float | Floats, s: float | Floats) -> Floats:
        """Difference of the wave over the edges, in the share that the input axis sees."""
        phase = self.order * known(motion, "angle", self.id) - np.arctan2(s, c)
        return interval_slope(np.cos(phase), motion.dt) * (np.hypot(c, s) * motion.projection * motion.gain)


@final
@dataclass(frozen=True)
class AngleLockedRate(_Wave):
    """A rate that depends on where the table points."""

    order: int = 1

    id = "angle_locked_rate"
    title = "rate locked to the table angle"
    meaning = "the gyro's error depends on where it points on its base: a magnet, heat or tilt"
    linear = (Param("c", OUTPUT, sd=1e-3, bound=0.1), Param("s", OUTPUT, sd=1e-3, bound=0.1))
    source = "IEEE Std 952-1997: magnetic sensitivity; Sensors 13 (2013) 2750: wobble of the table's axis"
    hides = "angle"
    belongs = "place"
    sharpened_by = ("rate_edges",)

    def __post_init__(self) -> None:
        checked_order(self.id, self.order, HIGHEST_ORDER)

    def wave(self, motion: Motion, c: float | Floats, s: float | Floats) -> Floats:
        """Mean of the wave over each interval."""
        return wave_at(motion, known(motion, "angle", self.id), self.order, c, s)


@final
@dataclass(frozen=True)
class TableTilt(_Wave):
    """Gravity on an accelerometer across the axis of a table that is not plumb."""

    id = "table_tilt"
    title = "tilt of the table's axis"
    meaning = "the table's axis is not plumb, and once a turn gravity leaks into accelerometers across it"
    linear = (Param("c", "rad", sd=1e-3, bound=1.0), Param("s", "rad", sd=1e-3, bound=1.0))
    source = "Titterton and Weston, section 11: tests on a turntable, verticality of its axis"
    instruments = ("accelerometer",)
    belongs = "place"
    sharpened_by = ("rate_edges",)

    def wave(self, motion: Motion, c: float | Floats, s: float | Floats) -> Floats:
        """Mean of the wave over each interval."""
        return STANDARD_GRAVITY * wave_at(motion, known(motion, "angle", self.id), 1, c, s)


@final
@dataclass(frozen=True)
class MagneticField(_Wave):
    """A rate that the magnetic field of the place makes: it stands with the Earth, however table and base are turned.

    Beside a horizontal Earth rate that is not declared to be known it is the same curve; shielding, another place or a
    second gyro tell it.
    """

    id = "magnetic_field"
    title = "magnetic field of the place"
    meaning = "the field of the place makes a rate that stands with the Earth, as the Earth's own rate does"
    linear = (Param("c", OUTPUT, sd=1e-3, bound=0.1), Param("s", OUTPUT, sd=1e-3, bound=0.1))
    source = "IEEE Std 952-1997: magnetic sensitivity"
    instruments = ("gyro",)
    belongs = "place"
    sharpened_by = ("rate_edges",)

    def wave(self, motion: Motion, c: float | Floats, s: float | Floats) -> Floats:
        """Mean of the wave over each interval."""
        return wave_at(motion, known(motion, "angle", self.id) - motion.base_turned, 1, c, s)


@final
@dataclass(frozen=True)
class EarthRate(_Wave):
    """Horizontal part of the Earth's rate, in a direction that nobody declared.

    The vertical part follows from latitude and tilt: it belongs to the true rate of `Motion`, not here.

    Attributes
    ----------
    share : float
        Largest share of the Earth's rate that the axis can see.
    level : float
        Share of the Earth's rate that the axis sees where c and s are taken, if other runs see another; 0: of all.
    """

    share: float = 1.0
    level: float = 0.0

    id = "earth_rate"
    title = "Earth rate"
    meaning = "the Earth's rotation as the input axis sees it"
    source = "Rate of rotation: WGS 84 (insenv.core.earth)"
    of_earth = True
    hides = "earth"
    belongs = "input"
    sharpened_by = ("rate_edges",)

    @property
    def linear(self) -> tuple[Param, ...]:
        """Two parts, of which none is larger than the whole."""
        most = EARTH_RATE * self.share
        return tuple(Param(name, OUTPUT, sd=most, bound=most) for name in ("c", "s"))

    def over(self, motion: Motion) -> Self:
        """The effect with what an axis of this tilt can see, whose tilt is known as well as `MOUNTED` says."""
        return replace(self, share=min(1.0, float(np.sqrt(1 - motion.projection**2)) + MOUNTED))

    def of_tilt(self, motion: Motion) -> Self:
        """The effect whose coefficients are of a run with this tilt and latitude; others see more or less of it."""
        return replace(self, level=motion.level if abs(motion.level) > LEAST_SHARE else 0.0)

    def wave(self, motion: Motion, c: float | Floats, s: float | Floats) -> Floats:
        """Mean of the wave over each interval; it stands with the Earth where the base was turned."""
        angle = known(motion, "angle", self.id)
        if self.level not in (0.0, motion.level):
            c, s = c * (motion.level / self.level), s * (motion.level / self.level)
        return wave_at(motion, angle - motion.base_turned if motion.base_turned else angle, 1, c, s)
