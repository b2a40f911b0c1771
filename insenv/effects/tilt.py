"""Tilt of the base under an accelerometer.

    base_tilt       c th + drift t
    base_settling   c exp(-t / tau)

with th the angle by which the base has turned, integrated from the gyros, and c gravity if the tilt is real.
The ramp takes up what a constant gyro offset and the Earth's rate leave in th; the gyros' angle random walk stays in
it, as a walk of the accelerometer's output that its maker's figures know nothing of.
A base that settles is, to an accelerometer whose gyros do not resolve c / (g tau), the curve of a warm-up.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import CurveEffect, LinearEffect, Param
from insenv.effects.forms import columns, decay, known, spread, time_constants


@final
@dataclass(frozen=True)
class BaseTilt(LinearEffect):
    """Gravity times the angle integrated from the gyros; for accelerometers alone."""

    id = "base_tilt"
    title = "base tilt"
    meaning = "the base turns, as the gyros show, and gravity leaks into the level accelerometers"
    linear = (Param("c", "m/s^2", sd=10.0, bound=15.0), Param("drift", "m/s^3", sd=1e-3, bound=0.1))
    needs = ("base_tilt",)
    source = "Titterton and Weston, section 10: levelling"
    of_base = True
    instruments = ("accelerometer",)
    of_time = True
    belongs = "input"
    carries = ("rate_random_walk",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Mean tilt and mean time of each interval, shape (..., n, 2)."""
        return columns(u, known(motion, "base_tilt", self.id), motion.middle)


@final
@dataclass(frozen=True)
class BaseSettling(CurveEffect):
    """A base that tilts to its place exponentially; for accelerometers alone.

    On one recording at rest it is the curve of ``bias_warm_up``. So no search tries it.
    """

    id = "base_settling"
    title = "settling of the base"
    meaning = "the base under the unit tilts to its place after it was set down"
    linear = (Param("c", "m/s^2", sd=0.01, bound=0.1),)
    shapes = (Param("tau", "s", sd=300.0, low=0.5),)
    source = "Titterton and Weston, section 10: levelling; first-order relaxation of a support"
    instruments = ("accelerometer",)
    of_time = True
    sudden = True
    belongs = "place"
    told_by = "an inclinometer, or a second unit, on the same base"

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Exact mean of the exponential, shape (..., n)."""
        return spread(u, theta[..., 0, None] * decay(motion, theta[..., 1, None]))

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1)."""
        return time_constants(motion)
