"""Gyros turned by hand or by a stepper beside a reference with errors of its own; shares no code with insenv.

    y = g u(t) + b + noise,        w = reference of the angle: the integral of

    filter    u through a second-order low-pass of 3 to 8 Hz
    coarse    u at 12 to 25 Hz, straight lines between the readings, of uneven stamps
    leak      u + a v + b v(t - d), v the rate about another axis that moves along, a and b some per cent
    flex      u + white noise of the angle that grows with the rate (markers, soft mounts)
    jitter    u at times that are off by some milliseconds
    all       a draw of each, smaller

and of all of them late by 0 to 15 ms, with a little white noise of the angle. Every kind comes with hand-turned motion
(swings of random size and speed, with and without breaks) and with sweeps to and fro of a stepper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, fftconvolve, lfilter

Floats = NDArray[np.float64]
FINE = 0.001
KINDS = ("filter", "coarse", "leak", "flex", "jitter", "all", "clean")
MOTIONS = ("hand", "breaks", "sweeps")

#: What an instrument adds to its output, of the true rate and angle [rad/s].
Law = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True)
class Case:
    """A recording: stamps, the gyro's readings, the reference's angle; and what is true of it."""

    t: Floats
    gyro: Floats
    angle: Floats
    late: float
    gain: float
    kind: str
    motion: str


def case(seed: int, kind: str, motion: str, duration: float = 100.0, row: float = 0.01, law: Law | None = None) -> Case:
    """One recording of the seed."""
    rng = np.random.default_rng((seed, KINDS.index(kind), MOTIONS.index(motion)))
    n = round(duration / FINE)
    u = moved(rng, n, motion)
    angle = np.cumsum(u) * FINE
    late = float(rng.uniform(0.0, 0.015))
    gain, bias = 1 + 0.01 * rng.standard_normal(), 0.01 * rng.standard_normal()
    out = u if law is None else u + law(u, angle)
    rows = np.arange(round(row / FINE), n, round(row / FINE))
    gyro = gain * _mean(out, rows) + bias + 10 ** rng.uniform(-3, -2) * rng.standard_normal(len(rows))
    seen = _seen(rng, u, kind, motion)
    reference = np.cumsum(seen) * FINE
    if kind == "coarse":
        reference = _coarse(rng, reference, float(rng.uniform(12.0, 25.0)))
    if kind in ("flex", "all"):
        loud = smoothed(np.abs(u), 0.1 / FINE)
        size = (1e-3 if kind == "flex" else 3e-4) * loud
        reference = reference + size * smoothed(rng.standard_normal(n), 0.02 / FINE) * np.sqrt(0.07 / FINE)
    at = np.arange(n) * FINE - late
    if kind in ("jitter", "all"):
        off = rng.standard_normal(len(rows)) * (0.003 if kind == "jitter" else 0.001)
        read = np.interp(rows * FINE - late + off, np.arange(n) * FINE, reference)
    else:
        read = np.interp(at, np.arange(n) * FINE, reference)[rows]
    read = read + 10 ** rng.uniform(-5, -4) * rng.standard_normal(len(rows))
    stamps = np.asarray(rows * FINE, np.float64)
    return Case(stamps, gyro, read, late, gain, kind, motion)


def smoothed(values: Floats, sigma: float) -> Floats:
    """A Gaussian mean over so many rows, mirrored at the ends; windows of seconds are thousands of rows."""
    half = int(4 * sigma + 0.5)
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / sigma) ** 2)
    padded = np.pad(values, half, mode="symmetric")
    return np.asarray(fftconvolve(padded, kernel / kernel.sum(), mode="valid"))


def moved(rng: np.random.Generator, n: int, motion: str) -> Floats:
    """The true rate about the axis [rad/s], every millisecond."""
    if motion == "sweeps":
        top, half = rng.uniform(0.8, 6.0), rng.uniform(0.5, 3.0)
        square = np.sign(np.sin(np.pi * np.cumsum(1 + 0.01 * rng.standard_normal(n)) * FINE / half))
        return np.asarray(top * smoothed(square, rng.uniform(0.02, 0.08) / FINE))
    size = smoothed(rng.standard_normal(n), 3.0 / FINE) * np.sqrt(3.0 / FINE)
    swing = rng.uniform(0.15, 0.5) / FINE
    u = smoothed(rng.standard_normal(n), swing) * np.sqrt(swing) * (1 + 0.7 * np.tanh(2 * size))
    tremor = smoothed(rng.standard_normal(n), 0.02 / FINE) * np.sqrt(0.02 / FINE) * 0.05
    u = rng.uniform(0.5, 3.0) * (u + tremor * np.abs(u))
    if motion == "breaks":
        t = np.arange(n) * FINE
        u = u * smoothed((np.sin(2 * np.pi * t / rng.uniform(8, 15)) > -0.3).astype(float), 0.15 / FINE)
    return np.asarray(u)


def _seen(rng: np.random.Generator, u: Floats, kind: str, motion: str) -> Floats:
    """The rate whose integral the reference reads, before its readings."""
    few = 1.0 if kind != "all" else 0.4
    if kind == "filter" or kind == "all":
        u = lfilter(*butter(2, rng.uniform(3.0, 8.0) / few * 2 * FINE), u)
    if kind == "leak" or kind == "all":
        other = moved(rng, len(u), motion)
        along = np.roll(u, round(rng.uniform(0.1, 0.4) / FINE))
        u = u + few * (rng.uniform(-0.03, 0.03) * other + rng.uniform(-0.03, 0.03) * along)
    return np.asarray(u)


def _coarse(rng: np.random.Generator, angle: Floats, rate: float) -> Floats:
    """The angle on straight lines between readings whose stamps are off by up to a tenth of their distance."""
    t = np.arange(len(angle)) * FINE
    at = np.arange(0.0, t[-1], 1 / rate)
    stamps = at + 0.05 / rate * rng.uniform(-1, 1, len(at))
    return np.interp(t, stamps, np.interp(at, t, angle))


def _mean(values: Floats, rows: NDArray[np.int64]) -> Floats:
    total = np.concatenate([[0.0], np.cumsum(values)])
    step = rows[1] - rows[0]
    return np.asarray((total[rows] - total[rows - step]) / step)
