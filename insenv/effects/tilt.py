"""Tilt of the base under an accelerometer.

    c th + drift t

with th the angle by which the base has turned, integrated from the gyros, and c gravity if the tilt is real.
The ramp takes up what a constant gyro offset and the Earth's rate leave in th; the gyros' angle random walk stays in
it, as a walk of the accelerometer's output that its maker's figures know nothing of.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import LinearEffect, Param
from insenv.effects.forms import columns, known


@final
@dataclass(frozen=True)
class BaseTilt(LinearEffect):
    """Gravity times the angle integrated from the gyros; for accelerometers alone."""

    id = "base_tilt"
    linear = (Param("c", "m/s^2", sd=10.0, bound=15.0), Param("drift", "m/s^3", sd=1e-3, bound=0.1))
    needs = ("base_tilt",)
    source = "Titterton and Weston, section 10: levelling"
    instruments = ("accelerometer",)
    of_time = True
    belongs = "input"
    carries = ("rate_random_walk",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Mean tilt and mean time of each interval, shape (..., n, 2)."""
        return columns(u, known(motion, "base_tilt", self.id), motion.middle)
