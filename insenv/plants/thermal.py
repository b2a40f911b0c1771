r"""Temperature as a function of time.

constant   T(t) = T0
ramp       T(t) = T0 + r t, until the end temperature is reached
warm-up    T(t) = T0 + D (1 - exp(-t/tau)), an instrument that heats itself after power-on
points     straight lines between given points, held outside: a thermal cycle of ramps and soaks

Temperatures are in kelvin, times in seconds. Each value depends on its own time alone, so a run may be cut
anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from insenv.core.recording import Floats


class Temperature(Protocol):
    """A temperature profile."""

    def at(self, t: Floats) -> Floats:
        """Temperature [K] at times ``t`` [s], same shape."""


@dataclass(frozen=True)
class Constant:
    """A thermostat at ``value`` [K]."""

    value: float = 298.15

    def at(self, t: Floats) -> Floats:
        """Temperature [K] at times ``t`` [s]."""
        return np.full(np.shape(t), self.value)


@dataclass(frozen=True)
class Ramp:
    """A chamber that goes from ``start`` to ``end`` [K] at ``slope`` [K/s], of either sign, and stays."""

    start: float
    end: float
    slope: float

    def at(self, t: Floats) -> Floats:
        """Temperature [K] at times ``t`` [s]."""
        change = self.end - self.start
        return self.start + np.sign(change) * np.minimum(abs(self.slope) * t, abs(change))


@dataclass(frozen=True)
class WarmUp:
    """An instrument that heats itself by ``rise`` [K] above ``start`` [K] with ``time_constant`` [s]."""

    start: float
    rise: float
    time_constant: float

    def at(self, t: Floats) -> Floats:
        """Temperature [K] at times ``t`` [s]."""
        temperature: Floats = np.expm1(t / -self.time_constant)
        temperature *= -self.rise
        temperature += self.start
        return temperature


@dataclass(frozen=True)
class Points:
    """Straight lines between (``times`` [s], ``values`` [K]); the first and the last value hold outside."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    def at(self, t: Floats) -> Floats:
        """Temperature [K] at times ``t`` [s]."""
        return np.interp(t, self.times, self.values)


def cycle(levels: Sequence[float], slope: float, soak: float) -> Points:
    """A thermal cycle: ``soak`` [s] at each of the ``levels`` [K], ramps at ``slope`` [K/s] between."""
    times, values = [0.0, soak], [levels[0], levels[0]]
    for level in levels[1:]:
        arrival = times[-1] + abs(level - values[-1]) / slope
        times += [arrival, arrival + soak]
        values += [level, level]
    return Points(tuple(times), tuple(values))
