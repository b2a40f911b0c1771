"""Errors of the bias: what is measured without any input.

    bias            c
    bias_drift      c t
    bias_warm_up    c exp(-t / tau)
    bias_step       c for t > t0

with t the time from the start of the run [s]. Each is the mean over the interval: the warm-up by its
antiderivative, the step by the share of the interval that lies after t0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, CurveEffect, Effect, LinearEffect, Param
from insenv.effects.forms import columns, decay, spread, time_constants
from insenv.effects.tilt import BaseSettling

#: A step's grid is no finer than this share of the recording, and no coarser than `STEP_SPACING`.
STEP_SHARE = 1e-3
#: Spacing of the times at which a step is tried [s]; a sharp step slips through a grid of 20 s.
STEP_SPACING = 10.0


@final
@dataclass(frozen=True)
class Bias(LinearEffect):
    """A constant: c."""

    id = "bias"
    part = "level"
    title = "bias"
    meaning = "a constant error"
    linear = (Param("c", OUTPUT, sd=0.1, bound=10.0),)
    source = "IEEE Std 952-1997 and 647-2006: bias"
    on_axes = ("gyro",)
    hides = "bias"

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Ones, shape (..., n, 1)."""
        return columns(u, np.ones(np.shape(u)))


@final
@dataclass(frozen=True)
class BiasDrift(LinearEffect):
    """A ramp: c t."""

    id = "bias_drift"
    title = "bias drift"
    meaning = "the bias moves in proportion to time"
    linear = (Param("c", OUTPUT + "/s", sd=3e-5, bound=1e-2),)
    source = "IEEE Std 952-1997: rate ramp"
    on_axes = ("gyro", "accelerometer")
    of_time = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Mean time of each interval, shape (..., n, 1)."""
        return columns(u, motion.middle)


@final
@dataclass(frozen=True)
class BiasWarmUp(CurveEffect):
    """A bias that settles after switching on: c exp(-t / tau)."""

    id = "bias_warm_up"
    title = "warm-up of the bias"
    meaning = "the bias settles exponentially after switch-on"
    linear = (Param("c", OUTPUT, sd=0.1, bound=10.0),)
    shapes = (Param("tau", "s", sd=300.0, low=0.5),)
    becomes = ("bias_drift", "bias_step")
    source = "IEEE Std 647-2006: warm-up; first-order heating of the sensor block"
    of_time = True
    sudden = True

    def twins(self, motion: Motion) -> tuple[Effect, ...]:
        """A base that settles under a level accelerometer at rest."""
        return (BaseSettling(),) if motion.angle is None else ()

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Exact mean of the exponential, shape (..., n)."""
        return spread(u, theta[..., 0, None] * decay(motion, theta[..., 1, None]))

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1)."""
        return time_constants(motion)


@final
@dataclass(frozen=True)
class BiasStep(CurveEffect):
    """A jump: c for t > t0."""

    id = "bias_step"
    title = "bias step"
    meaning = "the bias jumps once to another value and stays there"
    linear = (Param("c", OUTPUT, sd=0.1, bound=10.0),)
    shapes = (Param("t0", "s", sd=300.0),)
    source = "Offsets of a time series: Williams, J. Geodesy 76 (2003) 483"
    of_time = True
    sudden = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Share of each interval after t0, times c, shape (..., n)."""
        after = np.clip((motion.t[1:] - theta[..., 1, None]) / motion.dt, 0.0, 1.0)
        return spread(u, theta[..., 0, None] * after)

    def grid(self, motion: Motion) -> Floats:
        """Times between the first and the last interval, shape (g, 1)."""
        span = motion.dt * motion.n
        spacing = max(min(STEP_SPACING, 10 * STEP_SHARE * span), STEP_SHARE * span, motion.dt)
        return np.arange(motion.t[0] + spacing, motion.t[-1] - 0.5 * spacing, spacing)[:, None]
