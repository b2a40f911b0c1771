"""Noise of a gyro by its two-sided densities, made by methods of its own.

N^2        white
B^2 / w    flicker: a sum of first-order processes, one for each factor of 2 in time constant
K^2 / w^2  random walk: a cumulated sum
angle      white angle (counter, encoder): its first difference
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from blind.table import Floats

DEG_H = np.pi / 180 / 3600
ROOT_H = np.pi / 180 / 60


@dataclass(frozen=True)
class Noise:
    """Coefficients in SI: N [rad/sqrt s], B [rad/s], K [rad/s/sqrt s], white angle [rad]; white held for ``held``."""

    n: float
    b: float
    k: float
    angle: float = 0.0
    held: float = 0.0

    def scaled(self, factor: float) -> Noise:
        return replace(self, n=self.n * factor, b=self.b * factor, k=self.k * factor, angle=self.angle * factor)

    def density(self, f: Floats, dt: float) -> Floats:
        """Two-sided density at ``f`` > 0, folded at the sampling rate ``1 / dt``."""
        w = 2 * np.pi * f
        white = self.n**2 * np.sinc(f * self.held) ** 2 * max(1.0, self.held / dt if self.held else 1.0)
        return white + self.b**2 / w + (self.k / w) ** 2 + self.angle**2 * 4 * np.sin(np.pi * f * dt) ** 2 / dt


def rates(noise: Noise, n: int, dt: float, rng: np.random.Generator) -> Floats:
    """White, flicker and random walk, shape (n,) [rad/s]; what comes with reading an angle is added there."""
    total = noise.n / np.sqrt(dt) * rng.standard_normal(n)
    if noise.b:
        total += flicker(noise.b, n, dt, rng)
    return total + noise.k * np.sqrt(dt) * np.cumsum(rng.standard_normal(n))


def flicker(b: float, n: int, dt: float, rng: np.random.Generator) -> Floats:
    """Density b^2 / w between some 1 / (50 n dt) and the sampling rate.

    A process of variance v and time constant tau has the density 2 v tau / (1 + (w tau)^2); integrated over
    log(tau) / log(2) that is pi v / (w log 2).
    """
    variance = b**2 * np.log(2) / np.pi
    total = np.zeros(n)
    tau = 0.3 * dt
    while tau < 50 * n * dt:
        rho = np.exp(-dt / tau)
        z = rng.standard_normal(n)
        z[0] /= np.sqrt(1 - rho**2)
        total += np.sqrt(variance * (1 - rho**2)) * lfilter([1.0], [1.0, -rho], z)
        tau *= 2
    return total


#: Grades of gyros: log-uniform ranges of N [deg/sqrt h], B [deg/h], K [deg/h/sqrt h].
GRADES = {
    "laser": ((5e-4, 5e-3), (5e-4, 1e-2), (1e-4, 5e-3)),
    "fibre": ((2e-3, 5e-2), (5e-3, 0.3), (1e-3, 0.1)),
    "mems": ((0.05, 0.5), (0.5, 15.0), (0.3, 20.0)),
}


def draw(grade: str, rng: np.random.Generator) -> Noise:
    n, b, k = (float(np.exp(rng.uniform(np.log(low), np.log(high)))) for low, high in GRADES[grade])
    return Noise(n * ROOT_H, b * DEG_H, k * DEG_H / 60)
