"""Noise that changes every so many intervals only.

    y_k = x_j,    j = floor(k / hold)

with x the means of the noise over intervals that are ``hold`` times as long. Below the rate of x it has the spectrum of
the noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.effects.base import NoiseEffect


@dataclass(frozen=True)
class Held:
    """State of such a noise: its own at the slow rate, the last mean (...), and intervals that it still stands."""

    inner: Any
    value: Floats
    left: int


def held(slow: NoiseEffect, hold: int, theta: Floats, dt: float, state: Any, z: Floats) -> tuple[Floats, Held]:
    """As `NoiseEffect.drive` of ``slow``, with means that stand for ``hold`` intervals of ``dt`` each.

    Of the unit normals, shape (..., draws, n), those at the first of these intervals are taken. ``state`` is that of
    ``slow.start``, or of the chunk before.
    """
    n = z.shape[-1]
    before = state if isinstance(state, Held) else Held(state, np.zeros(np.shape(theta)[:-1]), 0)
    left, value, inner = min(before.left, n), before.value, before.inner
    mean = np.empty((*np.broadcast_shapes(z.shape[:-2], np.shape(theta)[:-1]), n))
    mean[..., :left] = value[..., None]
    if left < n:
        means, inner = slow.drive(theta, dt * hold, inner, z[..., left::hold])
        mean[..., left:] = np.repeat(means, hold, axis=-1)[..., : n - left]
        value = means[..., -1].copy()
    return mean, Held(inner, value, (before.left - n) % hold)


def held_integral(slow: NoiseEffect, hold: int, edges: NDArray[np.int64], dt: float) -> Floats:
    """`NoiseEffect.integral` of such a noise: between the edges of its own means the integral is linear."""
    own = np.unique(np.concatenate([edges // hold, -(-edges // hold)]))
    whole = slow.integral(own, dt * hold)
    low, high = np.searchsorted(own, edges // hold), np.searchsorted(own, -(-edges // hold))
    share = edges / hold - edges // hold
    before = whole[low] * (1 - share)[:, None] + whole[high] * share[:, None]
    between: Floats = before[:, low] * (1 - share) + before[:, high] * share
    return between
