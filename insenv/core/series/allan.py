"""Overlapping Allan deviation of rate data, with confidence.

For n rates r_i, each the mean over an interval dt, and their sum x_k = r_1 + ... + r_k (x_0 = 0),

    sigma^2(m dt) = 1 / (2 m^2 (n + 1 - 2 m)) * sum_{k=0}^{n-2m} (x_{k+2m} - 2 x_{k+m} + x_k)^2

Source: Riley, Handbook of Frequency Stability Analysis, NIST SP 1065 (2008), equation 11.
The interval of confidence is chi-square with the equivalent degrees of freedom of Greenhall and Riley,
Uncertainty of stability variances based on finite differences, PTTI 2003 (also in SP 1065). The power law of
the noise, S(f) ~ f^alpha of the rate, is given or found from the lag-1 autocorrelation: Riley and Greenhall,
Power law noise identification using the lag 1 autocorrelation, EFTF 2004 (also in SP 1065).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insenv.core.compiled import jit
from insenv.core.errors import InputError

Floats = NDArray[np.float64]

#: Noises by the slope of the Allan deviation, from -1 to 1/2: Q, N, B and K of IEEE Std 952.
QUANTIZATION, WHITE, FLICKER, WALK = NOISES = (
    "quantization",
    "angle_random_walk",
    "bias_instability",
    "rate_random_walk",
)
#: Exponents alpha of the rate's density f^alpha that are told apart.
POWER_LAWS = dict(zip(NOISES, (2, 0, -1, -2), strict=True))


@dataclass(frozen=True)
class Allan:
    """Allan deviation of a rate, in the rate's own unit; shapes (..., k) with the batch of the rate in front.

    taus      : shape (k,), s, averaging times, ascending
    deviation : Allan deviation
    lower, upper : ends of the confidence interval of the deviation
    edf       : equivalent degrees of freedom of the variance
    alpha     : exponent of the rate's density f^alpha that edf supposes
    """

    taus: Floats
    deviation: Floats
    lower: Floats
    upper: Floats
    edf: Floats
    alpha: NDArray[np.int64]


def allan_deviation(
    rate: ArrayLike,
    dt: float,
    taus: ArrayLike | None = None,
    *,
    confidence: float = 0.6827,
    noise: str | None = None,
) -> Allan:
    """Overlapping Allan deviation of evenly sampled rates without gaps.

    rate : shape (..., n), n >= 2, each the mean over one interval (increments divided by dt); any unit
    dt : s
    taus : shape (k,), s, rounded to multiples of dt, the same multiple kept once; default `log_taus`
    confidence : probability that the interval covers the deviation, for Gaussian noise
    noise : key of `POWER_LAWS` that edf supposes at every tau; default: identified at each tau

    Raises InputError for rates that are not finite or fewer than two and for a tau outside [dt, n dt / 2].
    """
    rate = np.asarray(rate, dtype=np.float64)
    n = rate.shape[-1] if rate.ndim else 0
    if n < 2:
        raise InputError(f"the Allan deviation was asked for of {n} rates; wanted at least two")
    factors = _factors(log_taus(n, dt) if taus is None else taus, dt, n)
    rows = [_row(row, factors, noise) for row in rate.reshape(-1, n)]
    shape = (*rate.shape[:-1], len(factors))
    deviation, edf, alpha = (np.array([row[i] for row in rows], np.float64).reshape(shape) for i in range(3))
    lower, upper = _interval(deviation, edf, confidence)
    return Allan(np.asarray(factors * dt, np.float64), deviation, lower, upper, edf, alpha.astype(np.int64))


def octave_taus(n: int, dt: float) -> Floats:
    """Averaging times dt, 2 dt, 4 dt ... up to a quarter of n intervals (at least dt), s, shape (k,)."""
    return np.asarray(dt * 2.0 ** np.arange(int(math.log2(max(n // 4, 1))) + 1), np.float64)


def log_taus(n: int, dt: float, count: int = 50) -> Floats:
    """At most `count` averaging times, s, shape (k,), evenly spaced in the logarithm.

    Multiples of dt without repetition, up to a quarter of n intervals: beyond it fewer than about three
    degrees of freedom are left.
    """
    return np.asarray(dt * np.unique(np.round(np.geomspace(1, max(n // 4, 1), count))), np.float64)


def _factors(taus: ArrayLike, dt: float, n: int) -> NDArray[np.int64]:
    if not 0.0 < dt < math.inf:
        raise InputError(f"the Allan deviation was asked for of rates {dt:g} s apart; wanted more than zero")
    taus = np.atleast_1d(np.asarray(taus, dtype=np.float64))
    ratio = np.round(taus / dt)
    inside = (ratio >= 1) & (ratio <= n // 2)
    if not inside.all():
        raise InputError(
            f"an averaging time of {taus[~inside][0]:g} s was asked for of {n} rates {dt:g} s apart; "
            f"wanted from {dt:g} s to {n // 2 * dt:g} s"
        )
    return np.unique(ratio).astype(np.int64)


#: Rates times averaging times from which on compiled loops win back what it takes to import numba.
LONG = 3_000_000


def _row(rate: Floats, factors: NDArray[np.int64], noise: str | None) -> tuple[Floats, Floats, Floats]:
    """Deviation, edf and alpha of one series, each of shape (k,)."""
    # The second difference does not see the mean; without it the sum stays small and its rounding with it.
    with np.errstate(invalid="ignore"):
        mean = rate.mean()
    if not np.isfinite(mean):
        raise InputError("the Allan deviation was asked for of rates with NaN or infinity; wanted finite rates")
    if rate.size * factors.size < LONG:
        x = np.concatenate([[0.0], np.cumsum(rate - mean)])
        sums = np.array([_sum_of_squares(x, m) for m in factors.tolist()])
    else:
        x = _compiled(_cumulated)(np.ascontiguousarray(rate), mean)
        sums = _compiled(_squared_second_differences)(x, factors)
    terms = len(x) - 2 * factors
    deviation = np.sqrt(sums / (2.0 * terms)) / factors
    alpha = _power_laws(x, factors) if noise is None else np.full(len(factors), POWER_LAWS[noise], np.int64)
    edf = np.array([_edf(int(a), int(m), int(t)) for a, m, t in zip(alpha, factors, terms, strict=True)])
    return deviation, edf, alpha.astype(np.float64)


def _sum_of_squares(x: Floats, m: int) -> float:
    """Sum over k of (x[k + 2m] - 2 x[k + m] + x[k])^2."""
    z = x[2 * m :] - 2.0 * x[m:-m] + x[: -2 * m]
    return float(z @ z)


# The two kernels are plain Python that numba compiles when the Allan deviation of a long series is first asked for.


def _cumulated(rate: Floats, mean: float) -> Floats:
    """Running sum of the rates without their mean, from zero, shape (n + 1,)."""
    x = np.empty(rate.size + 1)
    total = 0.0
    x[0] = total
    for i in range(rate.size):
        total += rate[i] - mean
        x[i + 1] = total
    return x


def _squared_second_differences(x: Floats, factors: NDArray[np.int64]) -> Floats:
    """Sum over k of (x[k + 2m] - 2 x[k + m] + x[k])^2 for each m, shape (k,).

    One block of x after the other for all m: a block and its neighbours are then in cache for most of them.
    """
    block = 8192
    sums = np.zeros(factors.size)
    for start in range(0, x.size, block):
        for j in range(factors.size):
            m = factors[j]
            stop = min(start + block, x.size - 2 * m)
            if stop <= start:
                continue
            near, middle, far = x[start:stop], x[start + m : stop + m], x[start + 2 * m : stop + 2 * m]
            part = 0.0
            for k in range(near.size):
                z = far[k] - 2.0 * middle[k] + near[k]
                part += z * z
            sums[j] += part
    return sums


@lru_cache(maxsize=4)
def _compiled(kernel: Callable[..., Floats]) -> Any:
    allowed = {"reassoc", "contract", "nsz"}  # lets the sum be vectorised, keeps NaN and infinity exact
    return jit(kernel, fastmath=allowed)


def _power_laws(x: Floats, factors: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return alpha at each averaging factor; that of the factor before where few averages are left."""
    found, alpha = [], 0
    for m in factors:
        averages = np.diff(x[:: int(m)][: _MOST_AVERAGES + 1])
        if averages.size >= _FEWEST_AVERAGES:
            alpha = _power_law(averages)
        found.append(alpha)
    return np.array(found, dtype=np.int64)


_FEWEST_AVERAGES = 30
_MOST_AVERAGES = 20_000  # tells one power law from the next beyond doubt


def _power_law(averages: Floats) -> int:
    """Return alpha (-2, -1, 0 or 2) from the lag-1 autocorrelation r of averages less their straight line.

    Expected r: -1/2 for white phase, 0 for white rate; where r exceeds 1/3 the averages are differenced, and
    then -1/2 for white rate, -0.22 for flicker, 0 to 1/4 for random walk (`_correlation` at t = 1). The
    limits lie between. Flicker of phase, unknown in inertial instruments, is taken for white rate, which has
    a smaller edf.
    """
    time = np.linspace(-1.0, 1.0, averages.size)
    y = averages - averages.mean()
    y = y - time * (time @ y) / (time @ time)
    r = _lag_1_autocorrelation(y)
    if r < 1 / 3:
        return 2 if r < -0.4 else 0
    steps = np.diff(y)
    r = _lag_1_autocorrelation(steps - steps.mean())
    return 0 if r < -0.36 else -1 if r < -0.1 else -2


def _lag_1_autocorrelation(y: Floats) -> float:
    power = float(y @ y)
    return float(y[1:] @ y[:-1]) / power if power > 0 else 0.0


def _edf(alpha: int, m: int, terms: int) -> float:
    """Equivalent degrees of freedom of a sum of squared second differences that overlap.

    edf = M / (1 + 2 sum_{j=1}^{M-1} (1 - j/M) rho_j^2), with M the number of terms and rho_j the correlation
    of terms j apart: that of the fourth difference of the phase's generalised autocovariance, |t| for alpha
    = 0, t^2 ln|t| for -1, |t|^3 for -2 (Greenhall and Riley with F -> infinity, the phase being exact at the
    ends of an interval). It is negligible beyond three averaging times; many lags are summed on a grid, as
    theirs are.
    """
    if alpha == 2:  # white phase: terms share a phase at the lags m and 2 m only
        shared = max(0.0, 1 - m / terms) * (4 / 6) ** 2 + max(0.0, 1 - 2 * m / terms) * (1 / 6) ** 2
        return terms / (1 + 2 * shared)
    last = min(terms - 1, 3 * m)
    step = max(1.0, last / _LAGS)
    lags = np.arange(step, last + 0.5 * step, step)
    rho = _correlation(alpha, lags / m)
    # Each lag of the grid stands for `step` terms; by symmetry so does the one at lag zero.
    return terms / (step * (1.0 + 2.0 * float(np.sum((1.0 - lags / terms) * rho**2))))


_LAGS = 300


def _correlation(alpha: int, t: Floats) -> Floats:
    """Correlation of two second differences t averaging times apart, shape of t."""

    def phase(u: Floats) -> Floats:
        u = np.abs(u)
        if alpha == 0:
            return -u
        if alpha == -2:
            return u**3
        return u**2 * np.log(np.where(u > 0, u, 1.0))

    def fourth(u: Floats) -> Floats:
        return 6 * phase(u) - 4 * (phase(u - 1) + phase(u + 1)) + phase(u - 2) + phase(u + 2)

    return np.asarray(fourth(t) / fourth(np.zeros(1)))


def _interval(deviation: Floats, edf: Floats, confidence: float) -> tuple[Floats, Floats]:
    from scipy.special import chdtri  # inverse of the survival function; scipy.stats costs a second to import

    tail = 0.5 * (1.0 - confidence)
    lower, upper = (np.sqrt(edf / chdtri(edf, p)) for p in (tail, 1.0 - tail))
    return deviation * lower, deviation * upper
