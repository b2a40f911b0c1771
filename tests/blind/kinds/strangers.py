"""Causes that no catalogue has: what a search must flag, and must not make worse by a wrong name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from blind.climate import lagged
from blind.parts import Part, encoder, frequency, gyro, top
from blind.table import Floats
from blind.world import World

Rng = np.random.Generator


def hump(w: World, r: Rng) -> Part:
    """A disturbance that comes and goes once."""
    centre, width = w.duration * r.uniform(0.2, 0.45), w.duration * r.uniform(0.03, 0.08)
    return gyro("", w.mean(np.exp(-(((w.t - centre) / width) ** 2) / 2)))


def hot_ripple(w: World, r: Rng) -> Part:
    """Five cycles per turn, growing with temperature."""
    return gyro("", w.mean(np.cos(5 * w.a + r.uniform(0, 6)) * (w.kelvins - w.kelvins.mean())))


def relay(w: World, r: Rng) -> Part:
    """A thermostat's current: on and off, its periods uneven."""
    period = w.duration * r.uniform(0.04, 0.1)
    lengths = period * r.uniform(0.6, 1.4, 2 * int(w.duration / period) + 8)
    state = np.searchsorted(np.cumsum(0.5 * lengths), w.t) % 2
    return gyro("", w.mean((2.0 * state - 1).astype(np.float64)))


def history(w: World, r: Rng) -> Part:
    """The motor's heat: follows the square of past rates."""
    grid = np.arange(0.0, w.duration + 2)
    heat = lagged((w.trajectory.rate(grid) / top(w)) ** 2, w.duration * r.uniform(0.02, 0.06))
    return gyro("", w.mean(np.interp(w.t, grid, heat)))


def telegraph(w: World, r: Rng) -> Part:
    """A mode of the laser that flips at random moments."""
    gaps = r.exponential(w.duration * r.uniform(0.05, 0.12), 200)
    return gyro("", w.mean((np.searchsorted(np.cumsum(gaps), w.t) % 2).astype(float)))


def chirp(w: World, r: Rng) -> Part:
    """A pump that speeds up during the test."""
    f = frequency(w, r)
    return gyro("", w.mean(np.sin(2 * np.pi * f * w.t * (1 + 0.4 * w.t / w.duration))))


def sawtooth(w: World, r: Rng) -> Part:
    """A mirror that is driven to its end and reset."""
    period = w.duration * r.uniform(0.06, 0.15)
    return gyro("", w.mean((w.t / period + r.uniform()) % 1))


def belt(w: World, r: Rng) -> Part:
    """A toothed belt: 3.37 cycles of bias per turn."""
    return gyro("", w.mean(np.cos(r.uniform(2.2, 2.8) * w.a + r.uniform(0, 6))))


def growing_encoder(w: World, r: Rng) -> Part:
    """An encoder that comes loose: its harmonic grows."""
    angle, x = w.trajectory.angle(w.rows), w.rows / w.duration
    return encoder(w, "", (0.2 + x**2) * np.cos(r.integers(1, 4) * angle + r.uniform(0, 6)))


def burst(w: World, r: Rng) -> Part:
    """A crane passes: ringing for a short while, several times."""
    total: Floats = np.zeros_like(w.t)
    for t0 in w.duration * r.uniform(0.05, 0.95, 5):
        since = np.maximum(w.t - t0, 0)
        total += (w.t > t0) * np.exp(-since / (0.01 * w.duration)) * np.sin(since * 2 * np.pi * 12 / w.duration)
    return gyro("", w.mean(total))


#: By name: the cause, and the procedures in which it exists.
STRANGERS: dict[str, tuple[Callable[[World, Rng], Part], tuple[str, ...]]] = {
    "hump": (hump, ("rest", "reversal", "staircase", "constant")),
    "hot ripple": (hot_ripple, ("staircase", "reversal", "sine", "constant")),
    "relay": (relay, ("rest", "staircase", "sine")),
    "rate history": (history, ("staircase", "with_stops")),
    "telegraph": (telegraph, ("rest", "staircase", "reversal")),
    "chirp": (chirp, ("rest", "constant", "staircase")),
    "sawtooth": (sawtooth, ("rest", "constant", "sine")),
    "belt": (belt, ("reversal", "staircase", "constant", "sine")),
    "loose encoder": (growing_encoder, ("reversal", "staircase", "constant")),
    "bursts": (burst, ("rest", "reversal", "staircase")),
}
