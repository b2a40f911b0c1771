"""Trajectories of a rate table: angle and rate as exact functions of time.

A table speeds up at a limited acceleration, so a commanded ladder of rates is a chain of straight lines in rate and of
parabolas in angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Trajectory(Protocol):
    """Rate [rad/s] and angle [rad] of the table at any times [s]."""

    def rate(self, t: Floats) -> Floats: ...

    def angle(self, t: Floats) -> Floats: ...


@dataclass(frozen=True)
class Knots:
    """Rate that is linear between knots; the angle is its exact integral."""

    times: Floats
    rates: Floats
    start: float = 0.0

    def rate(self, t: Floats) -> Floats:
        return np.interp(t, self.times, self.rates)

    def angle(self, t: Floats) -> Floats:
        steps = np.diff(self.times)
        reached = np.concatenate([[0.0], np.cumsum(0.5 * (self.rates[1:] + self.rates[:-1]) * steps)])
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.times) - 2)
        past = t - self.times[k]
        slope = (self.rates[k + 1] - self.rates[k]) / steps[k]
        inside = np.where(t > self.times[-1], 0.0, 0.5 * slope * past**2)
        return self.start + reached[k] + self.rates[k] * past + inside


@dataclass(frozen=True)
class Swing:
    """A steady rate with a sine upon it."""

    mean: float
    amplitude: float
    frequency: float
    phase: float
    start: float = 0.0

    def rate(self, t: Floats) -> Floats:
        return self.mean + self.amplitude * np.sin(2 * np.pi * self.frequency * t + self.phase)

    def angle(self, t: Floats) -> Floats:
        w = 2 * np.pi * self.frequency
        return self.start + self.mean * t + self.amplitude / w * (np.cos(self.phase) - np.cos(w * t + self.phase))


def ladder(rates: Floats, dwell: float, acceleration: float, start: float) -> Knots:
    """The table holds each rate for ``dwell`` seconds, the change to it included."""
    times, values = [0.0], [float(rates[0])]
    for index, rate in enumerate(rates[1:], start=1):
        begin = index * dwell
        needed = min(abs(rate - values[-1]) / acceleration, 0.8 * dwell)
        if needed > 0:
            times += [begin, begin + needed]
            values += [values[-1], float(rate)]
    times.append(max(len(rates) * dwell, times[-1]) + 1.0)
    values.append(values[-1])
    return Knots(np.array(times), np.array(values), start)


def triangle(top: float, period: float, duration: float, start: float) -> Knots:
    """Slow sweeps of the rate between minus and plus ``top``."""
    times = np.arange(0.0, duration + period, 0.5 * period)
    return Knots(times, np.where(np.arange(len(times)) % 2 == 0, -top, top).astype(float), start)


def positions(angles: Floats, dwell: float, rate: float, start: float) -> Knots:
    """The table rests at each angle for ``dwell`` seconds; between two it turns at up to ``rate``."""
    times, values, at = [0.0], [0.0], 0.0
    for index, goal in enumerate(angles[1:], start=1):
        way = float(goal - at)
        half = min(0.4 * dwell, max(2.0, abs(way) / rate))
        top = way / half  # a triangle of rate, its base twice as long as `half`
        times += [index * dwell - 2 * half, index * dwell - half, index * dwell]
        values += [0.0, top, 0.0]
        at = float(goal)
    times.append(len(angles) * dwell + 1.0)
    values.append(0.0)
    return Knots(np.array(times), np.array(values), start)


PROFILES = ("rest", "constant", "reversal", "staircase", "sine", "sweep", "with_stops", "positions")


def draw(profile: str, duration: float, top: float, rng: np.random.Generator) -> Trajectory:
    """One trajectory of a kind; ``top`` is the largest rate [rad/s] that instrument and logging allow."""
    start = rng.uniform(0, 2 * np.pi)
    acceleration = np.deg2rad(rng.choice([10.0, 30.0, 100.0, 300.0]))
    if profile in ("sine", "sweep", "positions"):
        return _flowing(profile, duration, top, start, rng)
    if profile in ("rest", "constant"):
        rate = 0.0 if profile == "rest" else rng.choice([-1, 1]) * top * rng.uniform(0.2, 0.9)
        return Knots(np.array([0.0, duration + 1]), np.full(2, rate), start)
    if profile == "reversal":
        turns = 2 * int(rng.integers(3, 9))
        rate = top * rng.uniform(0.3, 1.0)
        return ladder(rate * np.where(np.arange(turns) % 2 == 0, 1.0, -1.0), duration / turns, acceleration, start)
    steps = top * np.array([0.08, 0.15, 0.25, 0.4, 0.6, 0.8, 1.0])[-int(rng.integers(5, 8)) :]
    steps = np.concatenate([steps, -steps])
    repeats = int(rng.integers(3, 6))
    order = np.concatenate([rng.permutation(steps) for _ in range(repeats)])
    if profile == "with_stops":
        order = np.stack([np.zeros(len(order)), order], axis=1).ravel()
    return ladder(order, duration / len(order), acceleration, start)


def _flowing(profile: str, duration: float, top: float, start: float, rng: np.random.Generator) -> Trajectory:
    """Without dwells at one rate."""
    if profile == "sine":
        period = rng.uniform(duration / 60, duration / 12)
        mean = rng.choice([0.0, 0.0, 0.2]) * top
        return Swing(mean, 0.8 * top, 1 / period, rng.uniform(0, 6), start)
    if profile == "sweep":
        return triangle(top, duration / int(rng.integers(4, 10)), duration, start)
    count = int(rng.integers(12, 25))
    return positions(rng.uniform(0, 2 * np.pi, count), duration / count, 0.3 * top, start)


def follow(rates: list[tuple[float, float]], before: Trajectory) -> Knots:
    """Rates with a time each, from where a table stands that moved as ``before``; 30 deg/s^2 between them."""
    times, values, begin = [0.0], [rates[0][0]], 0.0
    for (old, dwell), (new, length) in pairwise(rates):
        begin += dwell
        times += [begin, begin + min(abs(new - old) / np.deg2rad(30), 0.5 * length)]
        values += [old, new]
    times.append(begin + rates[-1][1] + 1.0)
    values.append(rates[-1][0])
    return Knots(np.array(times), np.array(values), float(before.angle(np.zeros(1))[0]))
