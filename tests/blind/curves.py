"""Textbook errors of a gyro, one unit of each: shape (n,) or (n, k), from the contract's formulas.

``encoder`` curves are what the encoder reads too much [rad]; all others add to the measured rate.
"""

from __future__ import annotations

import numpy as np

from blind.table import Floats
from blind.world import World


def drift(w: World) -> Floats:
    return w.mean(w.t)


def warm_up(w: World, tau: float) -> Floats:
    return w.mean(np.exp(-w.t / tau))


def step(w: World, t0: float) -> Floats:
    """The share of each sample after ``t0``."""
    return np.clip((w.rows - t0) / w.dt, 0.0, 1.0) if not w.instant else (w.rows > t0).astype(float)


def temperature(w: World, power: int = 1) -> Floats:
    return w.mean((w.kelvins - w.reference) ** power)


def temperature_rate(w: World) -> Floats:
    return w.mean(w.climate.slope(w.t.ravel()).reshape(w.t.shape))


def thermal_lag(w: World, tau: float) -> Floats:
    return w.mean(w.kelvins - w.seen(w.climate.behind(tau)))


def scale(w: World) -> Floats:
    return w.mean(w.u)


def scale_drift(w: World) -> Floats:
    return w.mean(w.u * w.t)


def scale_warm_up(w: World, tau: float) -> Floats:
    return w.mean(w.u * np.exp(-w.t / tau))


def scale_temperature(w: World) -> Floats:
    return w.mean(w.u * (w.kelvins - w.reference))


def asymmetry(w: World) -> Floats:
    return w.mean(np.abs(w.u))


def cubic(w: World) -> Floats:
    return w.mean(w.u**3)


def anomaly(w: World, centre: float, width: float) -> Floats:
    """A fault around a rate, the same fault in both directions."""
    distance = np.abs(w.u) - centre
    return w.mean(np.sign(w.u) * np.exp(-(distance**2) / (2 * width**2)))


def lock_in(w: World, width: float | Floats) -> Floats:
    """Beat of a laser gyro that locks below ``width`` [rad/s], one or one for each sample, minus its input rate.

    A table may cross the dead zone within a sample: where the rate changes, the mean is that of a rate that is linear
    between the ends of the sample, by the integral of the root.
    """
    widths = np.broadcast_to(np.asarray(width, dtype=float), (w.n,))
    steady = w.mean(beat(w.u, widths[:, None]) - w.u)
    if w.instant:
        return steady
    first, last = w.rate_at_ends
    changes = np.abs(last - first) > 1e-3 * widths
    span = np.where(changes, last - first, 1.0)
    exact = (integral_of_beat(last, widths) - integral_of_beat(first, widths)) / span - 0.5 * (first + last)
    return np.where(changes, exact, steady)


def beat(u: Floats, width: Floats) -> Floats:
    """Beat frequency of a locking gyro at the input rate ``u``."""
    free = np.abs(u) > width
    return np.where(free, np.sign(u) * np.sqrt(np.where(free, u**2 - width**2, 0.0)), 0.0)


def integral_of_beat(u: Floats, width: Floats) -> Floats:
    """Antiderivative of `beat`, zero within the dead zone."""
    size = np.maximum(np.abs(u), width)
    root = np.sqrt(size**2 - width**2)
    return 0.5 * (size * root - width**2 * np.log((size + root) / width))


def encoder(w: World, order: int, phase: float = 0.0) -> Floats:
    """Error of the encoder at the rows [rad]."""
    return np.cos(order * w.trajectory.angle(w.rows) + phase)


def locked(w: World, order: int, phase: float = 0.0) -> Floats:
    return w.mean(np.cos(order * w.a + phase))


def tone(w: World, frequency: float, phase: float = 0.0) -> Floats:
    return w.mean(np.sin(2 * np.pi * frequency * w.t + phase))


def late(w: World, delay: float) -> Floats:
    """Error of an encoder whose reading is older than its row by ``delay`` [rad]."""
    return w.trajectory.angle(w.rows - delay) - w.trajectory.angle(w.rows)


def held(samples: Floats, count: int) -> Floats:
    """A register that is refreshed every ``count`` samples."""
    return samples[np.arange(len(samples)) // count * count]
