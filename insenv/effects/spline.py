"""Smooth curves that stand for an effect that nobody named: of time, temperature, rate or table angle.

    sum_j c_j B_j(x)

with B_j cubic B-splines on even knots. All of them but the first: together they add up to the constant, which
is the bias. Outside [low, high] the curve goes on as a constant. Over an interval x is taken as linear
between the edges, and the mean is exact: with A' = B,

    mean B = (A(x1) - A(x0)) / (x1 - x0)

and Simpson's rule, exact for a cubic, where x hardly moves.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Self, final

import numpy as np

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, LinearEffect, Param
from insenv.effects.forms import columns, known
from insenv.effects.thermal import temperatures

DEGREE = 3
#: Below this share of the knots' spacing the difference of antiderivatives loses digits.
_STILL = 1e-3
_SOURCE = "C. de Boor, A Practical Guide to Splines (1978)"


@dataclass(frozen=True)
class Spline(LinearEffect):
    """A cubic spline of something that is known at both edges of every interval.

    Attributes
    ----------
    low, high : float
        Range of x that the knots cover, in the SI unit of x.
    count : int
        Number of functions, at least 3.
    """

    low: float = 0.0
    high: float = 1.0
    count: int = 8

    source = _SOURCE
    generic = True

    def __post_init__(self) -> None:
        _checked(self.id, self.low, self.high, self.count)

    @abstractmethod
    def edges(self, u: Floats, motion: Motion) -> tuple[Floats, Floats]:
        """What the curve depends on, at the first and at the last edge of each interval, shapes (..., n)."""

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient for each function."""
        return _coefficients(self.count)

    def over(self, motion: Motion) -> Self:
        """The same curve with knots over the range that ``motion`` covers."""
        both = self.edges(motion.rate, motion)
        low, high = float(np.min(both)), float(np.max(both))
        # Where nothing changes any range will do: the functions are constant there and a fit drops them.
        return replace(self, low=low, high=high if high > low else low + 1.0)

    def over_all(self, motions: Iterable[Motion]) -> Self:
        """The same over the range that all of them cover together."""
        each = [self.over(motion) for motion in motions]
        return replace(each[0], low=min(one.low for one in each), high=max(one.high for one in each))

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Means of the functions over each interval, shape (..., n, count)."""
        first, last = self.edges(u, motion)
        curves = _clamped(self.count + 1)
        span = self.high - self.low
        means = _mean(*curves, (first - self.low) / span, (last - self.low) / span, _STILL / self.count)
        return columns(u, *np.moveaxis(means[..., 1:], -1, 0))


@final
@dataclass(frozen=True)
class SplineTime(Spline):
    """A smooth drift."""

    count: int = 12

    id = "spline_time"
    title = "smooth curve over time"
    meaning = "generic: something that changes slowly with time, cause unknown"
    of_time = True

    def edges(self, u: Floats, motion: Motion) -> tuple[Floats, Floats]:
        """Time from the start of the run [s]."""
        return motion.t[:-1], motion.t[1:]


@final
@dataclass(frozen=True)
class SplineTemperature(Spline):
    """A smooth curve of the temperature."""

    id = "spline_temperature"
    title = "smooth curve over temperature"
    meaning = "generic: something that goes with temperature"
    needs = ("temperature",)

    def edges(self, u: Floats, motion: Motion) -> tuple[Floats, Floats]:
        """Temperature [K]."""
        return temperatures(motion, self.id)


@final
@dataclass(frozen=True)
class SplineRate(Spline):
    """A smooth curve of the input; its mean over an interval stands for the input itself."""

    id = "spline_rate"
    title = "smooth curve over rate"
    meaning = "generic: something that goes with the rate"
    instruments = ("gyro",)
    of_rate = True

    def edges(self, u: Floats, motion: Motion) -> tuple[Floats, Floats]:
        """Input, the same at both edges."""
        return u, u


@final
@dataclass(frozen=True)
class SplineAngle(LinearEffect):
    """A smooth periodic curve of the table angle, with ``count`` functions to the turn."""

    count: int = 12

    id = "spline_angle"
    title = "smooth curve over angle"
    meaning = "generic: something that goes with the table angle"
    needs = ("angle",)
    source = _SOURCE
    instruments = ("gyro",)
    generic = True

    def __post_init__(self) -> None:
        _checked(self.id, 0.0, 2 * np.pi, self.count)

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient for each function."""
        return _coefficients(self.count)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Means of the functions over each interval, shape (..., n, count)."""
        turns = known(motion, "angle", self.id) / (2 * np.pi)
        last = turns[..., 1:]
        means = _mean(*_periodic(self.count + 1), last if motion.stands else turns[..., :-1], last, _STILL / self.count)
        return columns(u, *np.moveaxis(means[..., 1:], -1, 0))


def _checked(effect: str, low: float, high: float, count: int) -> None:
    if count < DEGREE or not low < high:
        raise InputError(
            f"effect {effect!r}: {count} functions from {low:g} to {high:g} given, "
            f"wanted at least {DEGREE} on a range that grows"
        )


@lru_cache
def _coefficients(count: int) -> tuple[Param, ...]:
    return tuple(Param(f"c{j}", OUTPUT, sd=0.1, bound=10.0) for j in range(1, count + 1))


@lru_cache
def _clamped(count: int) -> tuple[Any, Any]:
    """B-splines on [0, 1], constant outside, and their antiderivatives; each maps (...) to (..., count)."""
    from scipy.interpolate import BSpline  # slow to import

    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0, 1, count - DEGREE + 1), np.ones(DEGREE)])
    value = BSpline(knots, np.eye(count), DEGREE)
    antiderivative = value.antiderivative()

    def integral(x: Floats) -> Floats:
        inside = np.clip(x, 0.0, 1.0)
        total: Floats = antiderivative(inside) + value(inside) * (x - inside)[..., None]
        return total

    return lambda x: value(np.clip(x, 0.0, 1.0)), integral


@lru_cache
def _periodic(count: int) -> tuple[Any, Any]:
    """B-splines of period 1 and their antiderivatives; each maps (...) to (..., count)."""
    from scipy.interpolate import BSpline  # slow to import

    knots = np.arange(-DEGREE, count + DEGREE + 1) / count
    value = BSpline(knots, np.concatenate([np.eye(count), np.eye(count)[:DEGREE]]), DEGREE)
    antiderivative = value.antiderivative()
    start = antiderivative(0.0)

    def integral(x: Floats) -> Floats:
        whole = np.floor(x)
        # Every function has the same share 1 / count of a period.
        total: Floats = antiderivative(x - whole) - start + whole[..., None] / count
        return total

    return lambda x: value(x - np.floor(x)), integral


def _mean(value: Any, integral: Any, first: Floats, last: Floats, still: float) -> Floats:
    """Mean of functions while their argument goes from ``first`` to ``last``, shape (..., n, count)."""
    step = last - first
    first, last, short = np.broadcast_arrays(first, last, np.abs(step) < still)
    a, b, c, d = first[short], last[short], first[~short], last[~short]
    simpson = (value(a) + 4 * value(0.5 * (a + b)) + value(b)) / 6
    mean = np.empty((*short.shape, simpson.shape[-1]))
    mean[short], mean[~short] = simpson, (integral(d) - integral(c)) / (d - c)[..., None]
    return mean
