"""Temperature of an instrument on a table: room, chamber, its own heat; and what a thermometer says of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from blind.table import Floats

STEP = 1.0


def lagged(values: NDArray[Any], tau: float, step: float = STEP) -> Floats:
    """Output of a first-order lag that was settled at the first value, for an input that is linear between points."""
    x = step / tau
    decay = np.exp(-x)
    old, new = (1 - decay) / x - decay, 1 - (1 - decay) / x  # weights of the interval's two ends
    z = np.array([values[0] * (1 - new)])
    settled: Floats = lfilter([new, old], [1.0, -decay], values, zi=z)[0]
    return settled


@dataclass(frozen=True)
class Climate:
    """Temperature [degC] every `STEP` seconds from time 0, shape (m,), or (runs, m) where each run has its own.

    Times of several runs stand one run behind the other, each from its own beginning.
    """

    kind: str
    values: Floats

    @property
    def _runs(self) -> Floats:
        return np.atleast_2d(self.values)

    def _read(self, t: Floats, values: Floats) -> Floats:
        grid = STEP * np.arange(float(values.shape[1]))
        by_run = t.reshape(len(values), -1)
        return np.concatenate([np.interp(at, grid, row) for at, row in zip(by_run, values, strict=True)])

    def at(self, t: Floats) -> Floats:
        return self._read(t, self._runs)

    def slope(self, t: Floats) -> Floats:
        """Kelvin per second."""
        return self._read(t, np.gradient(self._runs, STEP, axis=1))

    def behind(self, tau: float) -> Climate:
        """The same seen through a first-order lag."""
        return Climate(self.kind, np.array([lagged(row, tau) for row in self._runs]))


KINDS = ("room", "chamber", "heater")


def draw(kind: str, duration: float, rng: np.random.Generator) -> Climate:
    t = STEP * np.arange(float(int(duration / STEP) + 3))
    room = rng.uniform(18, 27)
    if kind == "steady ramp":
        return Climate(kind, room + rng.uniform(4, 15) * t / duration)
    if kind == "own heat":
        return Climate(kind, room + rng.uniform(5, 15) * (1 - np.exp(-t / (duration * rng.uniform(0.1, 0.25)))))
    if kind == "room":
        period = duration * rng.uniform(0.15, 0.5)
        heat = rng.uniform(1, 6) * (1 - np.exp(-t / rng.uniform(300, 2000)))
        # Doors, people and the sun: no sine, or a tone in time would explain what follows the temperature.
        swings = [rng.uniform(0.4, 1) * np.sin(2 * np.pi * t / period * f + rng.uniform(0, 6)) for f in (0.6, 1, 1.7)]
        return Climate(kind, room + heat + rng.uniform(0.5, 2) * np.sum(swings, axis=0))
    if kind == "chamber":
        count = int(rng.integers(7, 13))
        levels = room + rng.uniform(-15, 25, count)
        set_point = np.interp(t, np.linspace(0, duration, count), levels)
        return Climate(kind, lagged(set_point, duration / count * rng.uniform(0.05, 0.3)))
    period = duration / rng.uniform(5, 9)  # a room's heater: on and off, no two cycles alike
    ends = np.cumsum(0.5 * period * rng.uniform(0.6, 1.4, 40))
    return Climate(
        kind, room + lagged(rng.uniform(2, 6) * (np.searchsorted(ends, t) % 2), period * rng.uniform(0.1, 0.4))
    )


def thermometer(climate: Climate, t: Floats, rng: np.random.Generator) -> Floats:
    """Readings at the times of the rows: noise, resolution, perhaps a slow refresh."""
    every = float(rng.choice([0.0, 0.0, 0.0, np.ptp(t) / 1000]))
    at = t if every == 0 else t[0] + every * np.floor((t - t[0]) / every + 1e-9)
    noise, resolution = rng.uniform(0.005, 0.04), rng.choice([0.001, 0.01, 0.0625])
    z = rng.standard_normal(len(t))
    if every:
        first = np.flatnonzero(np.diff(at, prepend=-1.0))  # where a reading is new
        z = np.repeat(z[first], np.diff(np.append(first, len(t))))
    return np.round((climate.at(at) + noise * z) / resolution) * resolution
