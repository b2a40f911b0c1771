r"""Recursive least squares on polynomials in scaled time.

    K = P h / (1 + h' P h),   X <- X + K (z - h' X),   P <- (I - K h') P,   h = [x^lowest ... x^highest],   x = t / span

with X_0 = 0 and P_0 = alpha I: equation (11) of Guo, Li, He (2018), DOI 10.11977/j.issn.1004-2474.2018.01.016. In
seconds H'H of a cubic over 300 s has the condition number 3.5e11, in scaled time 3.1e3. All channels share P. An alpha
of 1e4 pulls the result by 1e-5 of it, one of 1e12 by nothing that is seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from insenv.core.compiled import jit
from insenv.core.errors import InputError
from insenv.core.recording import Floats

#: P before any data: large enough that the pull to zero is below 1e-10 of the result.
ALPHA = 1e12


@dataclass(frozen=True)
class RecursiveFit:
    """State of a fit; the batch in front.

    Attributes
    ----------
    P : ndarray, shape (..., p, p)
        Inverse of the normal matrix.
    X : ndarray, shape (..., p, c)
        Coefficients of scaled time, for each of c channels.
    count : int
        Samples taken.
    """

    P: Floats
    X: Floats
    count: int = 0


@dataclass(frozen=True)
class Polynomial:
    """Polynomial x^lowest ... x^highest in x = t / span, t = dt, 2 dt, ...

    Attributes
    ----------
    dt : float
        [s]
    span : float
        Time that becomes one [s].
    lowest, highest : int
        Powers: (1, 3) is the paper's cubic, without a constant.
    """

    dt: float
    span: float
    lowest: int = 1
    highest: int = 3

    def begin(self, channels: int = 1, batch: int | None = None, alpha: float = ALPHA) -> RecursiveFit:
        """No data: X = 0 and P = alpha I."""
        if not (0 <= self.lowest <= self.highest and self.dt > 0 and self.span > 0 and alpha > 0):
            raise InputError("a fit of no powers, or with a time or alpha that is not positive; wanted the opposite")
        p = self.highest - self.lowest + 1
        shape = () if batch is None else (batch,)
        start = np.broadcast_to(alpha * np.eye(p), (*shape, p, p)).copy()
        return RecursiveFit(start, np.zeros((*shape, p, channels)))

    def update(self, fit: RecursiveFit, z: ArrayLike) -> RecursiveFit:
        """Take samples z, shape (..., n, c), one after the other."""
        data = np.asarray(z, np.float64)
        p, c = fit.X.shape[-2:]
        if data.ndim < 2 or data.shape[:-2] != fit.X.shape[:-2] or data.shape[-1] != c:
            raise InputError(f"samples of shape {data.shape} given; wanted {(*fit.X.shape[:-2], 'n', c)}")
        P, X = fit.P.reshape(-1, p, p).copy(), fit.X.reshape(-1, p, c).copy()
        samples = np.ascontiguousarray(data.reshape(len(P), *data.shape[-2:]))
        compiled()(samples, self.dt / self.span, fit.count, self.lowest, P, X)
        return RecursiveFit(P.reshape(fit.P.shape), X.reshape(fit.X.shape), fit.count + data.shape[-2])

    def coefficients(self, fit: RecursiveFit) -> Floats:
        """In powers of seconds, shape (..., p, c)."""
        powers = np.arange(self.lowest, self.highest + 1)
        return fit.X / self.span ** powers[:, None].astype(float)

    def columns(self, n: int) -> Floats:
        """H of the first n samples, shape (n, p): for a batch solution beside the recursive one."""
        x = np.arange(1, n + 1) * (self.dt / self.span)
        return np.asarray(x[:, None] ** np.arange(self.lowest, self.highest + 1), np.float64)


@lru_cache
def compiled() -> Callable[..., None]:
    """The loop, compiled when it is first asked for: numba costs more to import than the rest."""
    loop: Callable[..., None] = jit(recursion)
    return loop


def recursion(  # noqa: C901, PLR0912 -- a plain loop; numba wants it in one function
    z: Floats, step: float, count: int, lowest: int, P: Floats, X: Floats
) -> None:
    """Take samples z, shape (R, n, c), into P, shape (R, p, p), and X, shape (R, p, c), both changed in place.

    A cubic of two channels has a loop of its own, whose numbers stay in registers.
    """
    rows, n, c = z.shape
    p = P.shape[1]
    h, gain, row = np.empty(p), np.empty(p), np.empty(p)
    for i in range(rows):
        if p == 3 and c == 2:
            a, b, d, e, f, g = P[i, 0, 0], P[i, 0, 1], P[i, 0, 2], P[i, 1, 1], P[i, 1, 2], P[i, 2, 2]
            x0, x1, x2, y0, y1, y2 = X[i, 0, 0], X[i, 1, 0], X[i, 2, 0], X[i, 0, 1], X[i, 1, 1], X[i, 2, 1]
            for k in range(n):
                t = (count + k + 1) * step
                h0 = t**lowest
                h1 = h0 * t
                h2 = h1 * t
                p0, p1, p2 = a * h0 + b * h1 + d * h2, b * h0 + e * h1 + f * h2, d * h0 + f * h1 + g * h2
                inverse = 1.0 / (1.0 + (h0 * p0 + h1 * p1 + h2 * p2))
                k0, k1, k2 = p0 * inverse, p1 * inverse, p2 * inverse
                ex = z[i, k, 0] - (h0 * x0 + h1 * x1 + h2 * x2)
                ey = z[i, k, 1] - (h0 * y0 + h1 * y1 + h2 * y2)
                x0, x1, x2 = x0 + k0 * ex, x1 + k1 * ex, x2 + k2 * ex
                y0, y1, y2 = y0 + k0 * ey, y1 + k1 * ey, y2 + k2 * ey
                a, b, d = a - k0 * p0, b - k0 * p1, d - k0 * p2
                e, f, g = e - k1 * p1, f - k1 * p2, g - k2 * p2
            P[i, 0, 0], P[i, 0, 1], P[i, 0, 2], P[i, 1, 1], P[i, 1, 2], P[i, 2, 2] = a, b, d, e, f, g
            P[i, 1, 0], P[i, 2, 0], P[i, 2, 1] = b, d, f
            X[i, 0, 0], X[i, 1, 0], X[i, 2, 0], X[i, 0, 1], X[i, 1, 1], X[i, 2, 1] = x0, x1, x2, y0, y1, y2
            continue
        for k in range(n):
            t = (count + k + 1) * step
            h[0] = t**lowest
            for q in range(1, p):
                h[q] = h[q - 1] * t
            whole = 1.0
            for q in range(p):
                gain[q], row[q] = 0.0, 0.0
                for r in range(p):
                    gain[q] += P[i, q, r] * h[r]
                    row[q] += h[r] * P[i, r, q]
                whole += h[q] * gain[q]
            for j in range(c):
                error = z[i, k, j]
                for q in range(p):
                    error -= h[q] * X[i, q, j]
                for q in range(p):
                    X[i, q, j] += gain[q] / whole * error
            for q in range(p):
                for r in range(p):
                    P[i, q, r] -= gain[q] / whole * row[r]
