"""How large an effect is beside what a recording's own residual means show: generalised least squares, NumPy alone.

    size = |W M d|,     d = block means of the effect, M = projection beside the declared terms, W = whitening

The residual of a fit of the declared terms, with the terms that real tests have anyway, is taken as autoregressive of
first order from block to block; what whitens it whitens the effect. An effect of size 10 is one that a fit of it
alone would find ten standard deviations from zero.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Scale:
    """What whitens means of ``rows`` rows of each run: correlation, standard deviation, declared terms by run."""

    rows: int
    rho: float
    sd: float
    terms: tuple[Floats, ...]

    def size(self, effect: Sequence[Floats], beside: Sequence[Sequence[Floats]] = ()) -> float:
        """The effect's size; ``beside`` are further curves that may take its place, each by runs."""
        X = np.vstack([self._whitened(x) for x in self.terms])
        more = [np.concatenate([self._whitened(self._blocks(x)[:, None]) for x in curve]) for curve in beside]
        X = np.hstack([X, *more]) if more else X
        d = np.concatenate([self._whitened(self._blocks(x)[:, None])[:, 0] for x in effect])
        return float(np.linalg.norm(_left(d, X)) / self.sd)

    def _blocks(self, x: Floats) -> Floats:
        return blocks(x, self.rows)

    def _whitened(self, X: Floats) -> Floats:
        return np.asarray(X[1:] - self.rho * X[:-1])


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
    kept = [k for k, y in enumerate(readings) if len(y) // rows >= 4]
    each = [_placed(blocks(terms[k], rows), i, len(kept)) for i, k in enumerate(kept)]
    wide = [np.hstack([x, blocks(usual[k], rows)]) for x, k in zip(each, kept, strict=True)]
    left = _left(np.concatenate([blocks(readings[k], rows) for k in kept]), np.vstack(wide))
    parts = np.split(left, np.cumsum([len(x) for x in each])[:-1])
    before, after = (np.concatenate([p[a:b] for p in parts]) for a, b in ((0, -1), (1, None)))
    rho = float(np.clip(before @ after / max(float(before @ before), 1e-300), 0.0, 0.98))
    sd = float(np.std(after - rho * before))
    return Scale(rows, rho, sd, tuple(each))


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
