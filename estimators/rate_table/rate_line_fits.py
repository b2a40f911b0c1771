r"""Straight lines through the dwells of a rate test, for many tests at once: least squares, robust, by halves.

    K = sum w (x - xm) y / S,   F_0 = ym - K xm,   S = sum w (x - xm)^2,   xm, ym = means with the weights w
    var = sum c_i^2 sigma_i^2   with c_i the weight of point i in K or F_0, whatever the weights are

Robust: Tukey's biweight of u = r / (4.685 sigma), w = (1 - u^2)^2 for |u| < 1, after some rounds with Huber's weights.
The variance of a point is that of its white noise and of a spread d from setting to setting, which is what makes the
median of |r| / sigma that of a Gaussian:

    sigma_i^2 = N^2 / T_i + d^2,     median |r_i| / sigma_i = 0.6745 sqrt((m - 2) / m)

Noise that outlasts a point has a covariance C between them, shape (..., m, m): c' C c is added to the variances, and
the spread d is that beyond (1 - H) C (1 - H)'. All arrays are (..., m); points that are not there have the weight zero.
Source: Huber and Ronchetti, Robust Statistics, 2nd ed. (2009), chapters 7 and 13.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats

#: Median of the modulus of a unit normal.
MEDIAN = 0.674489750196082
_TUKEY, _HUBER = 4.685, 1.345
_ROUNDS = 20
#: Rounds in which the spread is found anew: it changes little.
_SPREADS = (0, 3, 9, 12, 15, 18)
#: Variance below which nothing is told apart [rad^2/s^2].
_LEAST = 1e-32


@dataclass(frozen=True)
class FittedLine:
    """K, F_0 and their variances and covariance, each of shape (...); NaN where there are not two rates."""

    k: Floats
    f0: Floats
    var_k: Floats
    var_f0: Floats
    cov: Floats

    def residual(self, x: Floats, y: Floats) -> Floats:
        """Points less line, shape (..., m)."""
        left: Floats = y - self.k[..., None] * x - self.f0[..., None]
        return left


def line(x: Floats, y: Floats, w: Floats, variance: Floats, slow: Floats | None = None) -> FittedLine:
    """Least squares with the weights ``w``; ``variance`` is that of the points. All of shape (..., m).

    ``slow``: covariance of noise that outlasts a point, shape (..., m, m).
    """
    of_k, of_f = _shares(x, w)
    parts = [(a * b * variance).sum(axis=-1) for a, b in ((of_k, of_k), (of_f, of_f), (of_k, of_f))]
    if slow is not None:
        parts = [
            p + _both(a, slow, b) for p, (a, b) in zip(parts, ((of_k, of_k), (of_f, of_f), (of_k, of_f)), strict=True)
        ]
    k = (of_k * np.where(w > 0, y, 0.0)).sum(axis=-1)
    return FittedLine(k, (of_f * np.where(w > 0, y, 0.0)).sum(axis=-1), *parts)


def _both(a: Floats, middle: Floats, b: Floats) -> Floats:
    return np.asarray((a[..., None, :] @ middle @ b[..., None])[..., 0, 0])


def _shares(x: Floats, w: Floats) -> tuple[Floats, Floats]:
    """Weight of each point in K and in F_0, shape (..., m); NaN where there are not two rates."""
    total = w.sum(axis=-1)
    some = np.where(total > 0, total, np.nan)
    xm = (w * x).sum(axis=-1) / some
    away = np.where(w > 0, x - xm[..., None], 0.0)
    spread = (w * away**2).sum(axis=-1)
    span = np.abs(away).max(axis=-1, initial=0.0)
    spread = np.where(span > 1e-6, spread, np.nan)
    of_k = w * away / spread[..., None]
    return of_k, w / some[..., None] - xm[..., None] * of_k


def of_residuals(x: Floats, w: Floats, slow: Floats) -> Floats:
    """What the covariance ``slow`` of the points makes of their residuals' variances, shape (..., m)."""
    of_k, of_f = (np.nan_to_num(share) for share in _shares(x, w))
    left = np.eye(x.shape[-1]) - x[..., None] * of_k[..., None, :] - of_f[..., None, :]
    return np.asarray(np.sum((left @ slow) * left, axis=-1))


def setting_spread(residual: Floats, white: Floats, there: NDArray[np.bool_]) -> Floats:
    """Variance d^2 from setting to setting, shape (...), beside the variance ``white`` of the points' noise."""
    m = there.sum(axis=-1)
    wanted = MEDIAN * np.sqrt(np.maximum(m - 2, 1) / np.maximum(m, 1))
    square = np.where(there, residual**2, np.nan)
    top = np.nanmax(np.where(there, square, 0.0), axis=-1, initial=0.0) / wanted**2 + _LEAST
    low, high = np.log(top) - 25.0, np.log(top)

    below, above = _middle(m, square.shape)

    def too_small(variance: Floats) -> NDArray[np.bool_]:
        ordered = np.sort(np.sqrt(square / (white + variance[..., None] + _LEAST)), axis=-1).ravel()
        return np.asarray(0.5 * (ordered[below] + ordered[above])).reshape(square.shape[:-1]) > wanted

    enough = ~too_small(np.zeros(m.shape)) | (m < 3)
    for _ in range(16):
        middle = 0.5 * (low + high)
        more = too_small(np.exp(middle))
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return np.where(enough, 0.0, np.exp(high))


def _middle(m: NDArray[np.int64], shape: tuple[int, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where the two in the middle of ``m`` values stand among all that are sorted by rows, flat; NaN stand last."""
    low, high = (np.broadcast_to(np.maximum(k, 0), shape[:-1]).ravel() for k in ((m - 1) // 2, m // 2))
    begin = np.arange(len(low)) * shape[-1]
    return begin + low, begin + np.minimum(high, low + 1)


def robust(
    x: Floats, y: Floats, white: Floats, there: NDArray[np.bool_], *, weighed: bool, slow: Floats | None = None
) -> tuple[Floats, Floats]:
    """Weights of the robust line, shape (..., m), and the spread d^2 from setting to setting, shape (...).

    ``weighed``: the weights are also by the inverse of the points' variances; else equal. ``slow``: covariance of noise
    that outlasts a point, shape (..., m, m).
    """
    tests = there.astype(float)
    weights, d, own = tests, np.zeros(there.shape[:-1]), white
    for round_ in range(_ROUNDS):
        fit = line(x, y, weights, white)
        left = np.nan_to_num(fit.residual(x, y))
        if round_ in _SPREADS:
            own = white if slow is None else white + of_residuals(x, weights, slow)
            d = setting_spread(left, own, there)
        sigma = np.sqrt(own + d[..., None] + _LEAST)
        u = np.abs(left) / sigma
        if round_ < _ROUNDS // 2:
            kept = np.minimum(1.0, _HUBER / np.maximum(u, 1e-9))
        else:
            kept = np.maximum(1 - (u / _TUKEY) ** 2, 0.0) ** 2
        weights = tests * kept * (sigma**-2 if weighed else 1.0)
    return weights, d


def halves(x: Floats, y: Floats, w: Floats, variance: Floats, slow: Floats | None = None) -> tuple[Floats, Floats]:
    """Asymmetry |K(+) - K(-)| / mean of both and its standard deviation, each of shape (...)."""
    shares = [_shares(x, np.where(side, w, 0.0))[0] for side in (x > 0, x < 0)]
    plus, minus = ((share * np.where(w > 0, y, 0.0)).sum(axis=-1) for share in shares)
    apart, mean = shares[0] - shares[1], 0.5 * (plus + minus)
    square = (apart**2 * variance).sum(axis=-1) + (0.0 if slow is None else _both(apart, slow, apart))
    return np.abs(plus - minus) / np.abs(mean), np.sqrt(square) / np.abs(mean)


def largest(values: Floats, sd: Floats, there: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """Largest modulus of the values that are there, and the standard deviation of that one, each of shape (...)."""
    size = np.where(there, np.abs(values), -1.0)
    at = size.argmax(axis=-1)[..., None]
    return np.take_along_axis(size, at, -1)[..., 0], np.take_along_axis(sd, at, -1)[..., 0]


def mean_of_largest(sd: Floats) -> float:
    """Mean of the largest modulus of independent Gaussian values with standard deviations ``sd``, shape (m,)."""
    return _mean_of_largest(tuple(sd.tolist())) if len(sd) and sd.max() > 0 else 0.0


@lru_cache(maxsize=256)  # lines by all methods, of all power-ups, have the same noise
def _mean_of_largest(deviations: tuple[float, ...]) -> float:
    from scipy.special import erf  # slow to import

    sd = np.array(deviations)
    x = np.linspace(0.0, 8.0 * sd.max(), 2001)
    below = np.prod(erf(x[:, None] / (np.sqrt(2) * np.maximum(sd, 1e-3 * sd.max()))), axis=1)
    return float(np.trapezoid(1 - below, x))
