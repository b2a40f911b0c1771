"""A gyro: what it is exposed to, its chip's filter, its noise and its output."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Gyro:
    """An instrument; SI, noise in its usual one-sided definitions (white N, flicker B, walk K)."""

    grade: str
    white: float
    flicker: float
    walk: float
    bias: float
    gain: float
    #: "instant", "mean" or "increment".
    reading: str
    #: Smallest step of the output [rad/s], or weight of a pulse [rad] of increments.
    step: float
    #: Corner of the low-pass [Hz]; 0: none.
    corner: float
    poles: int

    @property
    def lag(self) -> float:
        """Group delay of the filter at low frequencies [s]."""
        return (1.0, np.sqrt(2.0))[self.poles - 1] / (2 * np.pi * self.corner) if self.corner else 0.0


def filtered(x: Floats, gyro: Gyro, step: float) -> Floats:
    """What passes the low-pass, in its steady state at the start."""
    if not gyro.corner or gyro.corner * 2 * step > 0.8:
        return x
    b, a = butter(gyro.poles, gyro.corner * 2 * step)
    return np.asarray(lfilter(b, a, x - x[0])) + x[0]


def noise(gyro: Gyro, n: int, step: float, rng: np.random.Generator) -> Floats:
    """Noise of the rate on the fine grid, before the filter: white, 1/f and walk, shape (n,)."""
    out = gyro.white / np.sqrt(step) * rng.standard_normal(n)
    blocks = max(int(np.ceil(n * step / 0.2)), 16)
    x = (np.arange(n) * step) / 0.2
    slow = _flicker(gyro.flicker, blocks + 2, 0.2, rng) + gyro.walk * np.sqrt(0.2) * np.cumsum(
        rng.standard_normal(blocks + 2)
    )
    return out + np.interp(x, np.arange(blocks + 2), slow)


def _flicker(b: float, n: int, step: float, rng: np.random.Generator) -> Floats:
    """1/f noise from the sum of first-order processes, three a decade: two-sided density B^2 / (2 pi f)."""
    taus = 10 ** np.arange(np.log10(step), np.log10(30 * n * step), 1 / 3)
    out = np.zeros(n)
    for tau in taus:
        # A Lorentzian of variance v has 2 v tau / (1 + (w tau)^2); with log-even taus they sum to v (pi / ln q) / w.
        v = b * b * np.log(10 ** (1 / 3)) / np.pi
        e = np.exp(-step / tau)
        drive = rng.standard_normal(n) * np.sqrt(v * (1 - e * e))
        drive[0] = rng.standard_normal() * np.sqrt(v)
        out += lfilter([1.0], [1.0, -e], drive)
    return out


def read(x: Floats, fine: Floats, at: Floats, gyro: Gyro, rng: np.random.Generator) -> Floats:
    """The output at the instants ``at`` of a rate ``x`` on the grid ``fine``; the first instant begins the first row.

    Returns shape (len(at) - 1,): rates, or increments [rad].
    """
    step = fine[1] - fine[0]
    if gyro.reading == "instant":
        return rounded(np.interp(at[1:], fine, x), gyro.step)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * step * (x[1:] + x[:-1]))])
    place = np.interp(at, fine, turned)
    if gyro.reading == "increment":
        if not gyro.step:
            return np.diff(place)
        return np.diff(np.floor(place / gyro.step + rng.random())) * gyro.step
    return rounded(np.diff(place) / np.diff(at), gyro.step)


def rounded(x: Floats, step: float) -> Floats:
    """To whole steps."""
    return np.round(x / step) * step if step else x
