r"""Noise that wanders further than an instrument's own bias does.

Where nobody says how much noise there is, flicker and walk take in what nothing else explains. Over a time T a bias
with an instability B and a walk K goes by about

    s = sqrt(B^2 + K^2 T)

Of 341 gyros at rest of the measured library whose noise wanders half go by less than 0.007 deg/s and nine in ten by
less than 0.07; of 374 accelerometers, those in hands and on motors among them, by 3 and 48 mm/s^2. What goes further
than gyros do, or than accelerometers that nobody holds, is an error of the reference, motion, or a cause that was not
recorded.

Source: IEEE Std 952-1997, annex C, of B and K.
"""

from __future__ import annotations

import math

import numpy as np

from insenv.core.series.allan import FLICKER, WALK
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import NOISE_TERMS, Problem

#: How far a bias goes at most by itself, by the unit of the output: 0.1 deg/s, 20 mm/s^2.
FARTHEST = {"rad/s": math.radians(0.1), "m/s^2": 0.02}
#: Deviations of B and K by which it must be further.
SURE = 2.0


def too_wide(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """A reason where noise that wanders stands for more than the instrument's own bias; none where it may be that."""
    span = float(np.ptp(problem.bins.time))
    least = wander = 0.0
    for term, power, share in zip(NOISE_TERMS, fit.noise.power, fit.noise.relative_sd, strict=True):
        if term.id not in (FLICKER, WALK) or not np.isfinite(share):
            continue
        value = math.sqrt(float(power) * (span if term.id == WALK else 1.0))
        wander, least = math.hypot(wander, value), math.hypot(least, value * max(0.0, 1 - SURE * float(share)))
    if least <= FARTHEST[problem.unit]:
        return ()
    gyro = problem.unit == "rad/s"
    size = f"{math.degrees(wander):.2g} deg/s" if gyro else f"{1e3 * wander:.2g} mm/s^2"
    reference = "an error of the reference, " if problem.turns else ""
    return (
        f"what is left wanders by {size}, further than the bias of {'a gyro' if gyro else 'an accelerometer'} does by "
        f"itself: {reference}motion, or a cause that was not recorded",
    )
