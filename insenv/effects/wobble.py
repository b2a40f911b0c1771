r"""Wobble of the table's axis, k times a turn.

The axis moves by the small rotation e(a) about two directions that stand still: that to which the horizontal part of
the gyro's axis points at the table angle a = 0, and the one counter-clockwise of it. As a complex number,

    e(a) = (c + i s) exp(i k a) + (c_r + i s_r) exp(-i k a)        forward and retrograde circle

The gyro's axis, exp(i a) in that plane and elevated by ``tilt``, sees cos(tilt) Re[de/dt exp(-i a)]:

    k cos(tilt) da/dt [-c sin (k-1) a - s cos (k-1) a - c_r sin (k+1) a + s_r cos (k+1) a]

the difference of a function of the angle over the edges, exact for any motion:

    k cos(tilt) d/dt [(c cos (k-1) a - s sin (k-1) a) / (k-1) + (c_r cos (k+1) a + s_r sin (k+1) a) / (k+1)]

with -s a for the first fraction where k = 1. Source: kinematics of a small rotation, to first order in e.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from insenv.core.motion import Motion, interval_slope
from insenv.core.recording import Floats
from insenv.effects.base import LinearEffect, Param
from insenv.effects.forms import checked_order, columns, known

#: Times that a table's axis wobbles in a turn, at most: bearings have few lobes that matter.
HIGHEST_ORDER = 12


@final
@dataclass(frozen=True)
class Wobble(LinearEffect):
    """A table axis that moves on a forward circle (c, s) and a retrograde one (c_r, s_r), ``order`` times a turn.

    At one tilt the forward circle is the curve of ``encoder_harmonic`` of order k - 1, the retrograde one that of
    order k + 1; tilts of the gyro tell them apart. So no search tries it. A forward circle of order 1 is an axis that
    leans and turns with the table: c does nothing then, and s is another tilt of the gyro.
    """

    order: int = 1

    id = "wobble"
    title = "wobble of the table's axis"
    meaning = "the axis of the table tilts as it turns, and the gyro with it"
    linear = tuple(Param(name, "rad", sd=1e-5, bound=1e-3) for name in ("c", "s", "c_r", "s_r"))
    needs = ("angle",)
    source = "Sensors 13 (2013) 2750: wobble of a rate table's axis; kinematics of a small rotation"
    instruments = ("gyro",)
    belongs = "reference"
    told_by = "another tilt of the gyro on the table"

    def __post_init__(self) -> None:
        checked_order(self.id, self.order, HIGHEST_ORDER)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Differences over the edges, shape (..., n, 4)."""
        k, angle = self.order, known(motion, "angle", self.id)
        slower, faster = (k - 1) * angle, (k + 1) * angle
        turned = [np.cos(slower) / (k - 1), -np.sin(slower) / (k - 1)] if k > 1 else [np.zeros_like(angle), -angle]
        turned += [np.cos(faster) / (k + 1), np.sin(faster) / (k + 1)]
        share = k * np.sqrt(1.0 - motion.projection**2)
        return columns(u, *(interval_slope(part, motion.dt) * share for part in turned))
