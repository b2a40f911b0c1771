r"""The result of a test at rest from its sums: bias, stability, Allan coefficients, warm-up.

Neighbouring means share one of the two in a difference, so that M differences have 2 M / 3 degrees of freedom: for
white noise their correlation is -1/2, and M / (1 + 2 / 4) are left. The terms of the Allan variance are those of
`estimators.common.allan_terms`.

Source: IEEE Std 952-1997, annex C.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, log, nan, pi, sin, sqrt

import numpy as np

from estimators.at_rest.static_bias_kernel import BEFORE, COUNT, DIFFERENCES, FREEDOM, OLD, PAIRS, SQUARES
from estimators.common.allan_terms import Fit, fitted, floor
from insenv.core.earth import EARTH_RATE
from insenv.core.rate_test import AllanResult, BiasSettling, Stability, StaticResult, Valued
from insenv.core.recording import Floats
from insenv.core.series.allan import FLICKER, QUANTIZATION, WALK, WHITE
from insenv.core.units import DEG_PER_HOUR

#: Means that the curve of the bias is shown with, and its warm-up fitted to, at most.
_CURVE = 400


@dataclass(frozen=True)
class Settings:
    """What `estimators.at_rest.static_bias` was told: times [s], samples, rates [rad/s], the axis's elevation [rad]."""

    label: str
    dt: float
    size: int
    factors: tuple[int, ...]
    warm_up: float
    scale_factor: float
    earth_rate: float
    tilt: float


def result(
    series: Floats,
    moments: Floats,
    cascade: Floats,
    told: Settings,
    fit: Fit = fitted,
) -> StaticResult:
    """From means over a second, shape (m, 4), and the sums of `estimators.at_rest.static_bias_kernel`.

    ``fit`` is what finds the terms of the Allan variance.
    """
    k = abs(told.scale_factor)
    allan = _allan(cascade, told.dt, k, fit)
    late = series[series[:, 0] >= told.warm_up]
    used = late if len(late) else series
    each = tuple(float(used[used[:, 3] == q, 1].mean()) / told.scale_factor for q in np.unique(used[:, 3]))
    second = told.size * told.dt
    bias = Valued(float(np.mean(each)), _sd_of_mean(allan, len(used) * second) if each else nan)
    curve = _curve(series)
    return StaticResult(
        label=told.label,
        duration=len(series) * second,
        bias=bias,
        earth_rate=told.earth_rate,
        earth_note=_earth_note(told),
        bias_of_each=each,
        repeatability=repeatability(each),
        stability=tuple(_stability(m, moments[j], used, told) for j, m in enumerate(told.factors)),
        allan=allan,
        warm_up=_warm_up(curve, k),
        warm_up_left_out=told.warm_up if len(late) else 0.0,
        t=curve[:, 0],
        series=curve[:, 1] / told.scale_factor,
        temperature=curve[:, 2] if np.isfinite(curve[:, 2]).all() else np.zeros(0),
    )


def repeatability(values: tuple[float, ...]) -> Valued:
    """Standard deviation with n - 1, and its own for Gaussian values; NaN for fewer than two."""
    if len(values) < 2:
        return Valued()
    spread = float(np.std(values, ddof=1))
    return Valued(spread, spread / sqrt(2 * (len(values) - 1)))


def _earth_note(told: Settings) -> str:
    if np.isnan(told.earth_rate):
        return "Earth rate not removed: no latitude in the manifest"
    removed = "Earth rate removed: " + f"{told.earth_rate / DEG_PER_HOUR:.3f} deg/h, its part along the table's axis"
    if abs(cos(told.tilt)) < 1e-6:
        return removed
    if abs(sin(told.tilt)) < 1e-6:
        removed = "Earth rate not removed: of a level input axis it is zero only if that points east or west"
    level = EARTH_RATE * cos(told.tilt) / DEG_PER_HOUR
    return (
        f"{removed}; its level part, up to {level:.3g} deg/h times the cosine of the latitude, depends on the azimuth"
    )


def _stability(m: int, sums: Floats, used: Floats, told: Settings) -> Stability:
    freedom = sums[FREEDOM] + max(sums[COUNT] - 1, 0.0)
    k = abs(told.scale_factor)
    value = sqrt((sums[BEFORE] + sums[SQUARES]) / freedom) / k if freedom > 0 else nan
    sd = value / sqrt(2 * freedom) if freedom > 0 else nan
    settled = _settled(m, used, told) if told.warm_up else Valued()
    return Stability(m * told.dt, Valued(value, sd), int(sums[COUNT] + sums[OLD]), settled)


def _settled(m: int, used: Floats, told: Settings) -> Valued:
    """The same of the means over a second that are left after the warm-up."""
    if m % told.size:
        return Valued()
    n, second = m // told.size, told.size * told.dt
    square, freedom = 0.0, 0
    for q in np.unique(used[:, 3]):
        mine = used[used[:, 3] == q]
        breaks = np.flatnonzero(np.abs(np.diff(mine[:, 0]) - second) > 0.5 * second) + 1
        means = np.concatenate(
            [piece[: len(piece) // n * n].reshape(-1, n).mean(axis=1) for piece in np.split(mine[:, 1], breaks)]
        )
        if len(means) > 1:
            square += float(((means - means.mean()) ** 2).sum())
            freedom += len(means) - 1
    if not freedom:
        return Valued()
    value = sqrt(square / freedom) / abs(told.scale_factor)
    return Valued(value, value / sqrt(2 * freedom))


def _allan(cascade: Floats, dt: float, k: float, fit: Fit) -> AllanResult:
    """Deviation at the octaves with their interval of confidence (68 %), and the terms."""
    from scipy.special import chdtri  # slow to import

    pairs = cascade[:, PAIRS]
    good = (pairs >= 2) & (cascade[:, DIFFERENCES] > 0)
    taus = np.asarray(dt * 2.0 ** np.arange(len(pairs)), np.float64)[good]
    variance = cascade[good, DIFFERENCES] / (2 * pairs[good]) / k**2
    edf = np.maximum(2 * pairs[good] / 3, 1.0)
    tail = 0.5 * (1 - 0.6827)
    lower, upper = (np.sqrt(variance * edf / chdtri(edf, p)) for p in (tail, 1 - tail))
    found = fit(taus, variance, edf)
    least, at = floor(taus, variance, edf)
    terms = (found.coefficients, found.p_value, found.others, found.left_out)
    return AllanResult(taus, np.sqrt(variance), lower, upper, *terms, least, at)


def _sd_of_mean(allan: AllanResult, duration: float) -> float:
    """Standard deviation of a mean over ``duration`` [rad/s], by the coefficients; a ramp is no noise."""
    if any(np.isnan(c.value) for c in allan.coefficients.values()):
        return float(allan.deviation[-1])  # no model to go by: as far as it strays over the longest means
    values = {name: c.value**2 for name, c in allan.coefficients.items()}
    parts = (
        values.get(WHITE, 0.0) / duration,
        2 * values.get(QUANTIZATION, 0.0) / duration**2,
        values.get(FLICKER, 0.0) * 2 * log(2) / pi,
        values.get(WALK, 0.0) * duration / 3,
    )
    return sqrt(sum(parts))


def _curve(series: Floats) -> Floats:
    """Means of the series in at most `_CURVE` groups, of the power-up with the most of it, shape (m, 4)."""
    powers, counts = np.unique(series[:, 3], return_counts=True)
    mine = series[series[:, 3] == powers[counts.argmax()]]
    n = max(1, -(-len(mine) // _CURVE))
    kept: Floats = mine[: len(mine) // n * n].reshape(-1, n, 4).mean(axis=1)
    return kept


def _warm_up(curve: Floats, k: float) -> BiasSettling | None:
    """How the bias settles; None for fewer than twenty means, or with more motion than rest among them."""
    t, y = curve[:, 0], curve[:, 1] / k
    if len(t) < 20 or float(np.median(np.diff(t))) * len(t) < 0.5 * (t[-1] - t[0]):
        return None
    end, begin = t >= t[-1] - min(0.1 * (t[-1] - t[0]), 3600.0), t <= t[0] + min(0.1 * (t[-1] - t[0]), 300.0)
    noise = float(np.std(np.diff(y))) / sqrt(2)
    rise = Valued(float(y[end].mean() - y[begin].mean()), noise * sqrt(1 / end.sum() + 1 / begin.sum()))
    amplitude, tau = _exponential(t - t[0], y)
    group = max(1, len(y) // 100)
    means = y[: len(y) // group * group].reshape(-1, group).mean(axis=1)
    limit = 3 * float(np.std(means[len(means) // 2 :]))
    outside = np.flatnonzero(np.abs(means - y[end].mean()) > limit)
    settled = 0.0 if not len(outside) else float(t[min((outside[-1] + 1) * group, len(t) - 1)])
    return BiasSettling(rise, amplitude, tau, settled, limit)


def _exponential(t: Floats, y: Floats) -> tuple[Valued, Valued]:
    """Amplitude and time constant of b + a exp(-t / tau); NaN where it explains too little."""
    from scipy.optimize import minimize_scalar  # slow to import

    about = y - y.mean()
    power = float(about @ about)
    if power <= 1e-20 * float(y @ y):
        return Valued(), Valued()

    def at(logarithm: float) -> tuple[float, Floats, Floats]:
        """Sum of squares that is left, residual, solution."""
        basis = np.stack([np.ones_like(t), np.exp(-t / np.exp(logarithm))], axis=1)
        x, *_ = np.linalg.lstsq(basis, y, rcond=None)
        away = y - basis @ x
        return float(away @ away), away, x

    grid = np.linspace(log(2 * (t[1] - t[0])), log(t[-1]), 40)
    best = int(np.argmin([at(g)[0] for g in grid]))
    inside = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    found = float(minimize_scalar(lambda g: at(g)[0], bounds=inside, method="bounded", options={"xatol": 1e-6}).x)
    left, away, (_, a) = at(found)
    tau = float(np.exp(found))
    sd = _deviations(t, float(a), tau, away)
    if abs(a) < 5 * sd[1] or left > 0.9 * power or tau > 0.9 * t[-1]:
        return Valued(), Valued()
    return Valued(float(a), float(sd[1])), Valued(tau, float(sd[2]))


def _deviations(t: Floats, a: float, tau: float, away: Floats) -> Floats:
    """Standard deviations of b, a and tau from the residual, whose neighbours are correlated, shape (3,)."""
    fall = np.exp(-t / tau)
    jacobian = np.stack([np.ones_like(t), fall, a * fall * t / tau**2], axis=1)
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    square = float(away @ away)
    rho = min(max(float(away[1:] @ away[:-1]) / max(square, 1e-300), 0.0), 0.99)
    scatter = square / max(len(t) - 3, 1) * (1 + rho) / (1 - rho)
    inverse = np.linalg.pinv((jacobian / size).T @ (jacobian / size))
    deviations: Floats = np.sqrt(np.maximum(np.diag(inverse), 0.0) * scatter) / size
    return deviations
