"""Tables, rests and noise of the recordings: NumPy alone, nothing of insenv.

A programme is a true table rate on a fine grid (`FINE` parts of a row), so that a row is the mean over its interval and
the angle at its end is exact. Noise is made in the frequency domain from the density with which strengths are judged,

    S(f) = N^2 + 0.44 B^2 / f + K^2 / (2 pi f)^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rng = np.random.Generator

DEG, HOUR, GRAVITY, EARTH = np.pi / 180, 3600.0, 9.80665, 7.292115e-5
DEG_H, ROOT_H = DEG / HOUR, DEG / np.sqrt(HOUR)
#: Parts of a row in which the truth is computed.
FINE = 4
#: Share of a run that is fitted where the manifest says nothing.
FITTED = 0.6


@dataclass(frozen=True)
class Grade:
    """An instrument: white noise, flicker and walk (SI), largest rate [rad/s], step of the encoder [rad]."""

    name: str
    n: float
    b: float
    k: float
    top: float
    encoder: float
    accel: float

    def density(self, f: Floats) -> Floats:
        """Of the rate [(rad/s)^2/Hz], one-sided over two."""
        f = np.maximum(f, 1e-9)
        return np.asarray(self.n**2 + 0.44 * self.b**2 / f + self.k**2 / (2 * np.pi * f) ** 2)


GRADES = {
    "laser": Grade("laser", 0.002 * ROOT_H, 0.002 * DEG_H, 0.001 * DEG_H / 60, 60 * DEG, 0.05 * DEG / HOUR, 3e-5),
    "fibre": Grade("fibre", 0.02 * ROOT_H, 0.03 * DEG_H, 0.02 * DEG_H / 60, 100 * DEG, 0.2 * DEG / HOUR, 2e-4),
    "mems": Grade("mems", 0.3 * ROOT_H, 4.0 * DEG_H, 2.0 * DEG_H / 60, 200 * DEG, 2.0 * DEG / HOUR, 1e-3),
}


@dataclass(frozen=True)
class Run:
    """One run: rows of length ``dt`` that end at ``t``; truth at ``FINE`` parts of a row.

    ``fine`` holds the table rate at the fine edges, shape (n * FINE + 1,), ``told`` what the controller was told there:
    it jumps, the table does not. ``temperature`` is at the rows [degC].
    """

    dt: float
    fine: Floats
    temperature: Floats
    told: Floats

    @property
    def n(self) -> int:
        """Rows."""
        return (len(self.fine) - 1) // FINE

    @property
    def t(self) -> Floats:
        """Ends of the rows [s]."""
        return np.asarray(np.arange(1, self.n + 1) * self.dt, np.float64)

    @property
    def fine_angle(self) -> Floats:
        """Table angle at the fine edges [rad]."""
        step = 0.5 * (self.fine[1:] + self.fine[:-1]) * self.dt / FINE
        return np.concatenate([[0.0], np.cumsum(step)])

    @property
    def angle(self) -> Floats:
        """At the edges of the rows, shape (n + 1,)."""
        return self.fine_angle[::FINE]

    @property
    def rate(self) -> Floats:
        """Mean over each row, shape (n,)."""
        return np.asarray(np.diff(self.angle) / self.dt)

    def rows(self, fine: Floats) -> Floats:
        """Means over the rows of what is given at the fine edges."""
        middle = 0.5 * (fine[1:] + fine[:-1])
        return np.asarray(middle.reshape(self.n, FINE).mean(axis=1))


def programme(
    rates: Sequence[float] | Floats, dwell: float, dt: float, acceleration: float, repeat: int = 1
) -> tuple[Floats, Floats]:
    """Rate at the fine edges of a table that goes from rate to rate and back to zero, and what it is told."""
    step = dt / FINE
    targets = np.concatenate([np.repeat(np.tile(rates, repeat), int(round(dwell / step))), np.zeros(int(5 / step))])
    targets = targets[: len(targets) // FINE * FINE + 1]
    # Only jumps of the target need the limit: between them the rate is there.
    rate, now, most = np.empty(len(targets)), 0.0, acceleration * step
    for i, target in enumerate(targets):
        now += min(max(target - now, -most), most)
        rate[i] = now
    n = (len(rate) - 1) // FINE * FINE + 1
    return rate[:n], targets[:n]


def swing(amplitude: float, periods: Sequence[float], duration: float, dt: float) -> Floats:
    """A table that swings at one period after the other, for equal times."""
    step = dt / FINE
    n = int(round(duration / dt)) * FINE + 1
    which = np.minimum((np.arange(n) * len(periods) * 3 // n) % len(periods), len(periods) - 1)
    phase = np.concatenate([[0.0], np.cumsum(2 * np.pi * step / np.asarray(periods)[which][1:])])
    return np.asarray(amplitude * np.sin(phase))


def room(n: int, dt: float, rng: Rng, kind: str) -> Floats:
    """Temperature at the rows [degC]: a room, a unit that warms up, or a chamber that cycles."""
    t = np.arange(1, n + 1) * dt
    total = n * dt
    if kind == "chamber":
        return np.asarray(25 + 12 * np.sin(2 * np.pi * t / (0.37 * total) + rng.uniform(0, 6)))
    if kind == "warm-up":
        return np.asarray(32 - 8 * np.exp(-t / (0.2 * total)) + 0.3 * np.sin(2 * np.pi * t / (0.8 * total)))
    return np.asarray(25 + 0.4 * np.sin(2 * np.pi * t / total + rng.uniform(0, 6)))


def noise(grade: Grade, n: int, dt: float, rng: Rng) -> Floats:
    """Noise of the rows [rad/s], shape (n,), with the density of the grade."""
    m = 2 * n
    f = np.asarray(np.fft.rfftfreq(m, dt), np.float64)
    size = np.sqrt(grade.density(f) / dt)
    size[0] = 0.0
    wave = np.fft.rfft(rng.standard_normal(m)) * size
    return np.fft.irfft(wave, m)[:n]


@dataclass(frozen=True)
class Ruler:
    """Strength of an addition: norm of its whitened samples on the fitted rows beside the declared columns."""

    grade: Grade
    dt: float
    encoder: float = 0.0

    def root(self, n: int) -> Floats:
        """Square root of the density over the sampling period at the modes 1 ... n - 1."""
        f = np.arange(1, n) / (2 * n * self.dt)
        reading = 2 * (1 + 1 / 12) * self.encoder**2 / self.dt * (1 - np.cos(2 * np.pi * f * self.dt))
        return np.asarray(np.sqrt((self.grade.density(f) + reading) / self.dt))

    def whitened(self, runs: Sequence[Floats]) -> Floats:
        """Each run's fitted rows, (n,) or (n, k), as whitened modes without the level."""
        out = []
        for one in runs:
            kept = one[: int(FITTED * len(one))]
            modes = cosine(kept)[1:]
            root = self.root(len(kept))
            out.append(modes / (root if modes.ndim == 1 else root[:, None]))
        return np.concatenate(out)

    def strength(self, addition: Sequence[Floats], declared: Sequence[Floats]) -> float:
        """``addition`` (n,) and ``declared`` (n, k) of each run."""
        a, x = self.whitened(addition), self.whitened(declared)
        return float(np.linalg.norm(a - span(x) @ (span(x).T @ a)))


def span(x: Floats) -> Floats:
    """An orthonormal basis of what the columns span."""
    if not x.shape[1]:
        return x
    size = np.linalg.norm(x, axis=0)
    u, s, _ = np.linalg.svd(x[:, size > 0] / size[size > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-6])


def cosine(x: Floats) -> Floats:
    """Orthonormal cosine transform (DCT-II) along the first axis, by the Fourier transform of twice the length."""
    n = len(x)
    twice = np.fft.rfft(np.concatenate([x, x[::-1]]), axis=0)[:n]
    turn = np.exp(-0.5j * np.pi * np.arange(n) / n)
    modes = 0.5 * np.real(twice * (turn if x.ndim == 1 else turn[:, None]))
    modes[0] *= np.sqrt(1 / n)
    modes[1:] *= np.sqrt(2 / n)
    return np.asarray(modes)
