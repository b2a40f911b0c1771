"""Errors of the scale factor: what grows with the input rate u (its mean over the interval).

    scale_factor               c u
    scale_factor_drift         c u t
    scale_factor_warm_up       c u exp(-t / tau)
    scale_factor_temperature   c u (T - T_ref)
    scale_factor_asymmetry     c |u|
    scale_factor_cubic         c u^3
    scale_factor_anomaly       c sign(u) exp(-(|u| - u0)^2 / (2 s^2))

What is not linear in u takes the mean rate for the rate: exact where the rate is constant over an interval.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self, final

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, CurveEffect, LinearEffect, Param
from insenv.effects.forms import behind_the_table, columns, decay, time_constants
from insenv.effects.thermal import temperature_excess

#: Widths of an anomaly that a scan tries, as shares of the largest rate.
WIDTHS = (0.02, 0.05, 0.12)
#: Below this largest rate nothing can be said of single rates [rad/s]; about fourteen times the Earth's.
LEAST_RATE = 1e-3
#: Widths from the centre beyond which the bump is zero in double precision: a slow way to have nothing.
_NOWHERE = 39.0
#: Widths from zero below which the bump is a jump of the sign there.
ABOUT_ZERO = 0.5
#: A rate counts as run when at least this share of the recording lies near it.
LEAST_SHARE = 1e-3


@final
@dataclass(frozen=True)
class ScaleFactor(LinearEffect):
    """A wrong scale: c u."""

    id = "scale_factor"
    part = "gain"
    title = "scale factor"
    meaning = "the output is wrong in proportion to the input"
    linear = (Param("c", "1", sd=0.05, bound=0.5),)
    source = "IEEE Std 952-1997 and 647-2006: scale factor"
    on_axes = ("gyro",)
    of_response = True
    hides = "rate"
    instruments = ("gyro",)
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """The input, shape (..., n, 1)."""
        return columns(u, u)


@final
@dataclass(frozen=True)
class ScaleFactorDrift(LinearEffect):
    """A scale that runs away: c u t."""

    id = "scale_factor_drift"
    title = "scale-factor drift"
    meaning = "the scale factor moves in proportion to time"
    linear = (Param("c", "1/s", sd=1e-5, bound=0.1, per_run=True),)
    source = "IEEE Std 647-2006: scale factor stability"
    instruments = ("gyro",)
    of_time = True
    of_rate = True
    of_force = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Input times mean time, shape (..., n, 1)."""
        return columns(u, u * motion.middle)


@final
@dataclass(frozen=True)
class ScaleFactorWarmUp(CurveEffect):
    """A scale that settles after switching on: c u exp(-t / tau)."""

    id = "scale_factor_warm_up"
    title = "warm-up of the scale factor"
    meaning = "the scale factor settles exponentially after switch-on"
    linear = (Param("c", "1", sd=0.05, bound=0.2),)
    shapes = (Param("tau", "s", sd=300.0, low=0.5),)
    becomes = ("scale_factor_drift",)
    source = "IEEE Std 647-2006: warm-up; first-order heating of the sensor block"
    instruments = ("gyro",)
    of_time = True
    of_rate = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Input times the exact mean of the exponential, shape (..., n)."""
        return theta[..., 0, None] * decay(motion, theta[..., 1, None]) * u

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1)."""
        return time_constants(motion)


@final
@dataclass(frozen=True)
class ScaleFactorTemperature(LinearEffect):
    """A scale that follows the temperature: c u (T - T_ref)."""

    id = "scale_factor_temperature"
    title = "scale factor over temperature"
    meaning = "the scale factor follows the temperature"
    linear = (Param("c", "1/K", sd=1e-3, bound=1e-2),)
    needs = ("temperature",)
    source = "IEEE Std 952-1997 and 647-2006: scale factor temperature sensitivity"
    instruments = ("gyro",)
    of_rate = True
    of_force = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Input times mean excess of the temperature, shape (..., n, 1)."""
        return columns(u, u * temperature_excess(motion, self.id))


@final
@dataclass(frozen=True)
class ScaleFactorAsymmetry(LinearEffect):
    """A scale that differs between the two senses of rotation: c |u|."""

    id = "scale_factor_asymmetry"
    title = "scale-factor asymmetry"
    meaning = "clockwise and anticlockwise have different scale factors"
    linear = (Param("c", "1", sd=0.05, bound=0.2),)
    source = "IEEE Std 952-1997 and 647-2006: scale factor asymmetry"
    on_axes = ("gyro",)
    hides = "rate"
    instruments = ("gyro",)
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Magnitude of the input, shape (..., n, 1)."""
        return columns(u, np.abs(u))


@final
@dataclass(frozen=True)
class ScaleFactorCubic(LinearEffect):
    """A scale that bends symmetrically: c u^3."""

    id = "scale_factor_cubic"
    title = "cubic scale factor"
    meaning = "the scale factor changes with the square of the rate"
    linear = (Param("c", "1/({y})^2", sd=0.01, bound=1.0),)
    source = "IEEE Std 952-1997: scale factor non-linearity"
    hides = "rate"
    instruments = ("gyro",)
    of_rate = True
    bend = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Cube of the input, shape (..., n, 1)."""
        return columns(u, u * u * u)


@final
@dataclass(frozen=True)
class ScaleFactorAnomaly(CurveEffect):
    """A local fault around the rate u0, of width s and height c, odd in the rate.

    Attributes
    ----------
    wings : bool
        Whether it falls off as a resonance does, 1 / (1 + (|u| - u0)^2 / s^2). The wings look like a scale factor, so
        that of a fit has this form in its standard deviation.
    """

    wings: bool = False

    id = "scale_factor_anomaly"
    title = "local scale-factor anomaly"
    meaning = "the output is wrong near one rate only, as by a resonance or a faulty stage"
    linear = (Param("c", OUTPUT, sd=0.01, bound=0.02, per_rate=True),)
    shapes = (Param("u0", OUTPUT, sd=0.1, low=0.0), Param("s", OUTPUT, sd=0.05, low=1e-4))
    source = "IEEE Std 647-2006: scale factor error at single rates; a Gaussian stands for its unknown form"
    hides = "rate"
    instruments = ("gyro",)
    of_rate = True
    local = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """The bump, shape (..., n)."""
        c, centre, width = (theta[..., j, None] for j in range(3))
        distance = (np.abs(u) - centre) / width
        if self.wings:
            return c * np.sign(u) / (1.0 + distance * distance)
        if np.abs(distance).min(initial=np.inf) > _NOWHERE:
            return np.zeros(np.broadcast_shapes(distance.shape, np.shape(c)))
        return c * np.sign(u) * np.exp(-0.5 * distance * distance)

    def others(self) -> tuple[Self, ...]:
        """The bump with wings, or without."""
        return (replace(self, wings=not self.wings),)

    def blind(self, motion: Motion) -> str:
        """Beside a late reference, which is wrong most where the rate changes: at some rates by chance."""
        return behind_the_table(motion)

    def grid(self, motion: Motion) -> Floats:
        """Centres and widths, shape (g, 2): centres only where the recording has rates."""
        magnitude = np.abs(motion.rate).ravel()
        largest = float(magnitude.max(initial=0.0))
        if largest < LEAST_RATE:
            return np.empty((0, 2))
        return np.concatenate([_centres(magnitude, share * largest) for share in WIDTHS])

    def unseen(self, motion: Motion, shape: tuple[float, ...]) -> str:
        """A fault of which no rate passes the middle is any curve that rises to the end: none that is local.

        About zero it is a jump of the sign.
        """
        if shape[0] < ABOUT_ZERO * shape[1]:
            return "about zero it would be a jump of the sign"
        beyond = shape[0] > float(np.abs(motion.rate).max(initial=0.0)) * (1 - 1e-3)
        return "no rate lies beyond its middle" if beyond else ""


def _centres(magnitude: Floats, width: float) -> Floats:
    """Rates that were run, one per cell of one width, with that width; shape (g, 2).

    A recording of a few levels has those levels for its centres, whatever the width; a sweep has centres one
    width apart. Around zero, within half a width, the bump would be a jump in sign and no local fault.
    """
    _, mean = rates_run(magnitude, width)
    centres = mean[mean > ABOUT_ZERO * width]
    return np.stack([centres, np.full_like(centres, width)], axis=-1)


def rates_run(magnitude: Floats, width: float) -> tuple[NDArray[np.int64], Floats]:
    """Cells of one width that magnitudes of the rate, shape (n,), lie in, counted from rest, and their means there.

    Those that hold `LEAST_SHARE` of the recording; both of shape (cells,).
    """
    cell = (magnitude / width).astype(int)
    count = np.bincount(cell)
    mean = np.bincount(cell, magnitude) / np.maximum(count, 1)
    run = np.flatnonzero(count >= max(1.0, LEAST_SHARE * len(magnitude)))
    return run, mean[run]
