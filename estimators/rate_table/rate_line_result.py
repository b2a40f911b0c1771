r"""The result of a scale-factor test from its dwells: static output taken off, flags, lines by four methods."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimators.rate_table import rate_line_fits, rate_line_zeros
from estimators.rate_table.rate_dwells import OUTPUT, POWER, RATE, START, TEMPERATURE, TIME, TURNS
from estimators.rate_table.rate_line_flags import FALSE_ALARM, RULE, flags, same
from estimators.rate_table.rate_line_zeros import REST
from insenv.core.rate_test import Dwell, LineFit, RateLineResult, Valued
from insenv.core.recording import Floats


def result(dwells: Floats, noise: float, zeros: str, earth_rate: float) -> RateLineResult | None:
    """What the dwells, shape (d, `estimators.rate_table.rate_dwells.WIDTH`), tell, with the white noise [rad/sqrt(s)].

    None where there are no two rates to draw a line through.
    """
    made = [_dwell(row, noise) for row in dwells]
    rests = [d for d in made if abs(d.rate) < REST]
    method, reason = rate_line_zeros.method(rests, zeros)
    level = rate_line_zeros.level(rests, method)
    points = [p for d in made if (p := rate_line_zeros.point(d, rests, method)) is not None]
    rates = _rates(points)
    if len(rates) < 2:
        return None
    table, white = _table(points, rates)
    means, variance = _means(table, white)
    ((tukey, d),) = _robust(rates, means[None], variance[None])
    robust = _robust(rates, table, white) if len(table) > 1 else [(tukey, d)]
    flagged = flags(rates, (means, variance, np.array(d)), table, tukey)
    at = {f.rate for f in flagged}
    off = np.array([rate in at for rate in rates])
    bias = (level, earth_rate)
    setting, source = _setting(rates, table, white)
    ups = np.isfinite(table).sum(axis=0)
    whole = (means, variance, None if setting is None else setting / ups)
    fits = tuple(_fits(rates, whole, (tukey, d), off, bias, 0))
    each = tuple(
        fit
        for q, number in enumerate(sorted({p.power_up for p in points}))
        for fit in _fits(rates, (table[q], white[q], setting), robust[q], off, bias, number)
    )
    setting = float(np.median([spread for _, spread in robust])) if setting is None else setting
    spread = [replace(p, sd=float(np.hypot(p.sd, np.sqrt(setting)))) for p in points]
    repeats = {
        name: _repeatability([f for f in each if f.method == name]) for name in dict.fromkeys(f.method for f in fits)
    }
    return RateLineResult(
        tuple(spread),
        tuple(rests),
        method,
        reason,
        fits,
        each,
        flagged,
        RULE,
        FALSE_ALARM,
        repeats,
        noise,
        float(np.sqrt(setting)),
        source,
        earth_rate,
    )


def _dwell(row: Floats, noise: float) -> Dwell:
    return Dwell(
        rate=float(row[RATE]),
        output=float(row[OUTPUT]),
        zero=0.0,
        sd=noise / float(np.sqrt(row[TIME])),
        start=float(row[START]),
        duration=float(row[TIME]),
        turns=int(row[TURNS]),
        power_up=int(row[POWER]) or 1,
        temperature=float(row[TEMPERATURE]),
    )


def _rates(points: list[Dwell]) -> Floats:
    """The different rates, ascending, each the mean of its dwells, of which none is far from the first."""
    groups: list[list[float]] = []
    for rate in sorted(p.rate for p in points):
        if groups and bool(same(groups[-1][0], rate)):
            groups[-1].append(rate)
        else:
            groups.append([rate])
    return np.array([np.mean(group) for group in groups])


def _table(points: list[Dwell], rates: Floats) -> tuple[Floats, Floats]:
    """Outputs at the ``rates`` of each power-up and variances of their noise, shape (power-ups, rates); NaN: none.

    An output is that of a dwell at its own rate, moved to the mean rate by the difference: K is 1 within a percent.
    Dwells at one rate in one power-up are averaged by their time.
    """
    first, last = (f(p.power_up for p in points) for f in (min, max))
    y, w = np.zeros((2, last - first + 1, len(rates)))
    for p in points:
        at = int(np.abs(rates - p.rate).argmin())
        weight = p.duration
        y[p.power_up - first, at] += weight * (p.output - p.zero + rates[at] - p.rate)
        w[p.power_up - first, at] += weight
    variance = np.zeros_like(y)
    for p in points:
        at = int(np.abs(rates - p.rate).argmin())
        variance[p.power_up - first, at] += (p.duration * p.sd) ** 2
    keep = w.any(axis=1)
    w = np.where(w > 0, w, np.nan)[keep]
    return y[keep] / w, variance[keep] / w**2


def _means(table: Floats, white: Floats) -> tuple[Floats, Floats]:
    """Means over the power-ups, each less its own mean offset, and the variances of the noise, each of shape (rates,).

    Where all power-ups have all rates that changes nothing; else a power-up's bias would move the rates that it has.
    """
    there = np.isfinite(table)
    n = there.sum(axis=0)
    if not there.all():
        common = there.all(axis=0) if there.all(axis=0).any() else np.ones(table.shape[1], bool)
        own = np.nanmean(np.where(common, table - table[:1], np.nan), axis=1) if common.any() else np.zeros(len(table))
        own = np.nan_to_num(own - own.mean())
        table = table - own[:, None]
    return np.nansum(table, axis=0) / n, np.nansum(white, axis=0) / n**2


Measured = tuple[Floats, Floats, Floats | float | None]


#: Weights of the robust line at each rate, shape (rates,), and the variance from setting to setting beside it.
Robust = tuple[Floats, float]


def _robust(rates: Floats, table: Floats, white: Floats) -> list[Robust]:
    """The robust line of each power-up, over the rates that it has."""
    if np.isfinite(table).all():
        tukey, d = rate_line_fits.robust(rates, table, white, np.ones(table.shape, bool), weighed=False)
        return list(zip(tukey, d.tolist(), strict=True))
    found = []
    for y, noise in zip(table, white, strict=True):
        has = np.isfinite(y)
        tukey, d = rate_line_fits.robust(rates[has], y[has], noise[has], np.ones(int(has.sum()), bool), weighed=False)
        found.append((tukey, float(d)))
    return found


def _setting(rates: Floats, table: Floats, white: Floats) -> tuple[float | None, str]:
    """Variance from setting to setting and what it is from; None: of each fit's own residuals.

    Where three power-ups or more have all rates: that of their residuals about the mean residual at each rate, less the
    noise. What repeats there is the instrument's nonlinearity and no uncertainty.
    """
    whole = np.isfinite(table).all(axis=1)
    q, m = int(whole.sum()), len(rates)
    if q < 3 or m < 4:
        return None, "of the residuals"
    basis = np.stack([np.ones(m), rates], axis=1)
    left = table[whole] - table[whole].mean(axis=0)
    left = left - left @ np.linalg.pinv(basis).T @ basis.T
    square = float((left**2).sum()) / ((q - 1) * (m - 2))
    return max(square - float(white[whole].mean()), 0.0), "of the power-ups about their mean"


def _fits(
    rates: Floats,
    measured: Measured,
    robust: Robust,
    off: NDArray[np.bool_],
    bias: tuple[tuple[Valued, bool], float],
    power_up: int,
) -> Iterator[LineFit]:
    """The lines by all methods over the rates that were measured; none where there are not two."""
    y, white, setting = measured
    has = np.isfinite(y)
    rates, y, white, off = rates[has], y[has], white[has], off[has]
    if len(rates) < 2:
        return
    every = np.ones(len(rates), bool)
    tukey, d = robust
    variance = white + (d if setting is None else setting)
    kept = ~off if (~off).sum() > 1 else every
    for name, w, over in (
        ("all points", every.astype(float), every),
        ("without flagged", kept.astype(float), kept),
        ("robust", tukey, every),
        ("weighted", np.where(kept, 1 / (variance + 1e-30), 0.0), kept),
    ):
        yield _fit((name, power_up), (rates, y, w), (variance, white), over, bias)


def _fit(
    named: tuple[str, int],
    points: tuple[Floats, Floats, Floats],
    variances: tuple[Floats, Floats],
    over: NDArray[np.bool_],
    bias: tuple[tuple[Valued, bool], float],
) -> LineFit:
    x, y, w = points
    variance, white = variances
    fit = rate_line_fits.line(x, y, w, variance)
    left = fit.residual(x, y)
    (level, _), earth = bias
    k, f0 = float(fit.k), float(fit.f0)
    value = (f0 + level.value) / k - (0.0 if np.isnan(earth) else earth)
    asymmetry, asymmetry_sd = rate_line_fits.halves(x, y, w, variance)
    top = int(np.argmax(np.where(over, np.abs(x), -1.0)))
    return LineFit(
        method=named[0],
        power_up=named[1],
        scale_factor=Valued(k, float(np.sqrt(fit.var_k))),
        offset=Valued(f0, float(np.hypot(np.sqrt(fit.var_f0), level.sd))),
        bias=Valued(value, float(np.sqrt(fit.var_f0 + level.sd**2)) / abs(k)),
        rates=x,
        residuals=left,
        sd=np.sqrt(variance),
        weights=w,
        nonlinearity=_nonlinearity(x[over], left[over], np.sqrt(variance[over]), k, float(y[top])),
        noise_alone=rate_line_fits.mean_of_largest(np.sqrt(white[over])) / abs(float(y[top])),
        asymmetry=Valued(float(asymmetry), float(asymmetry_sd)),
    )


def _nonlinearity(x: Floats, left: Floats, sd: Floats, k: float, top: float) -> dict[str, Valued]:
    """By the keys of `insenv.core.rate_test.NORMALISATIONS`."""
    at = int(np.abs(left).argmax())
    worst, worst_sd = float(abs(left[at])), float(sd[at])
    fitted = k * float(np.abs(x).max())
    span = k * float(np.ptp(x))
    turning = np.abs(x) > REST
    relative = np.abs(left[turning] / (k * x[turning]))
    j = int(relative.argmax())
    rms = float(np.sqrt(np.mean(left**2)))
    rms_sd = float(np.sqrt(np.mean((left * sd) ** 2) / len(left))) / max(rms, 1e-300)
    return {
        "largest_output": Valued(worst / abs(top), worst_sd / abs(top)),
        "fitted_output": Valued(worst / fitted, worst_sd / fitted),
        "span": Valued(worst / span, worst_sd / span),
        "reading": Valued(float(relative[j]), float(sd[turning][j] / abs(k * x[turning][j]))),
        "rms": Valued(rms / abs(top), rms_sd / abs(top)),
    }


def _repeatability(fits: list[LineFit]) -> Valued:
    """Relative standard deviation of K over the power-ups, with n - 1; its own is that of Gaussian values."""
    k = np.array([fit.scale_factor.value for fit in fits])
    if len(k) < 2:
        return Valued()
    value = float(k.std(ddof=1) / k.mean())
    return Valued(value, value / float(np.sqrt(2 * (len(k) - 1))))
