"""How large an effect is beside what a recording's own residual means show: generalised least squares, NumPy alone.

    size = |W M d|,     d = block means of the effect, M = projection beside the declared terms, W = whitening

The residual of a fit of the declared terms, with the terms that real tests have anyway, has in the modes of a cosine
transform of each run a power that is smooth in frequency: its mean over neighbouring modes. What whitens it whitens
the effect. An effect of size 10 is one that a fit of it alone would find ten standard deviations from zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

Floats = NDArray[np.float64]
#: Modes on either side whose mean power is that of a mode, and the same as a share of its number.
LEAST_MODES, SHARE = 2, 0.15


@dataclass(frozen=True)
class Scale:
    """Root of the noise's power by modes of means over ``rows`` rows, and the declared terms whitened, by run."""

    rows: int
    root: tuple[Floats, ...]
    terms: tuple[Floats, ...]

    def size(self, effect: Sequence[Floats], beside: Sequence[Sequence[Floats]] = ()) -> float:
        """The effect's size; ``beside`` are further curves that may take its place, each by runs."""
        X = np.hstack([np.vstack(self.terms), *(self._whitened(curve)[:, None] for curve in beside)])
        return float(np.linalg.norm(_left(self._whitened(effect), X)))

    def _whitened(self, x: Sequence[Floats]) -> Floats:
        kept = [blocks(each, self.rows) for each in x if len(each) // self.rows >= FEWEST]
        return np.concatenate([_modes(each) / root for each, root in zip(kept, self.root, strict=True)])


#: Fewest means of a run.
FEWEST = 4


def blocks(x: Floats, rows: int) -> Floats:
    """Means over so many rows."""
    n = len(x) // rows
    return np.asarray(x[: n * rows].reshape(n, rows, *x.shape[1:]).mean(axis=1))


def _left(y: Floats, X: Floats) -> Floats:
    norm = np.linalg.norm(X, axis=0)
    X = X[:, norm > 0] / norm[norm > 0]
    q, s, _ = np.linalg.svd(X, full_matrices=False)
    q = q[:, s > 1e-9 * s[0]]
    return np.asarray(y - q @ (q.T @ y))


def scale_of(readings: Sequence[Floats], terms: Sequence[Floats], usual: Sequence[Floats], rows: int) -> Scale:
    """The scale of a recording's residual means; ``terms`` and ``usual`` by runs, shapes (n, k) and (n, m)."""
    kept = [k for k, y in enumerate(readings) if len(y) // rows >= FEWEST]
    each = [_placed(blocks(terms[k], rows), i, len(kept)) for i, k in enumerate(kept)]
    wide = [np.hstack([x, blocks(usual[k], rows)]) for x, k in zip(each, kept, strict=True)]
    left = _left(np.concatenate([blocks(readings[k], rows) for k in kept]), np.vstack(wide))
    parts = np.split(left, np.cumsum([len(x) for x in each])[:-1])
    root = tuple(np.sqrt(_smooth(_modes(part) ** 2)) for part in parts)
    return Scale(rows, root, tuple(_modes(x) / r[:, None] for x, r in zip(each, root, strict=True)))


def _modes(x: Floats) -> Floats:
    """Orthonormal cosine transform along the first axis."""
    return np.asarray(dct(x, axis=0, norm="ortho"))


def _smooth(power: Floats) -> Floats:
    """Mean power of neighbouring modes; the constant has none of its own."""
    n = len(power)
    total = np.concatenate([[0.0, 0.0], np.cumsum(power[1:])])
    k = np.arange(n)
    reach = np.maximum(LEAST_MODES, (SHARE * k).astype(int))
    low, high = np.clip(k - reach, 1, n - 1), np.clip(np.maximum(k + reach, 2 * LEAST_MODES + 1), 1, n - 1)
    mean = (total[high + 1] - total[low]) / (high + 1 - low)
    return np.maximum(mean, 1e-12 * float(np.max(mean)) + 1e-300)


def _placed(x: Floats, run: int, runs: int) -> Floats:
    """Terms with a constant of each run beside them."""
    ones = np.zeros((len(x), runs))
    ones[:, run] = 1.0
    return np.hstack([ones, x])


def size_for(wanted: float, of: Callable[[float], float], low: float, high: float) -> float | None:
    """The size at which an effect is so large; None where nothing credible is."""
    if not of(low) < wanted <= of(high):
        return None
    for _ in range(18):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if of(middle) >= wanted else (middle, high)
    return high
