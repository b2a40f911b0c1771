r"""The result of a scale-factor test from its dwells: static output taken off, flags, lines by four methods.

Rule for flags, stated beforehand. The dwells of all power-ups are averaged rate by rate; z is the residual of such a
mean from the robust line in units of its standard deviation (white noise and the robust spread from setting to
setting, of all rates or of the half with the least noise, whichever is larger). A rate is flagged where |z| > 5 and
that of the opposite direction exceeds 5 too; one whose opposite was not measured where |z| > 10; and only if more than
half of the power-ups deviate to the same side. Tests with fewer than ten rates have no flags.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimators import rate_line_fits
from estimators.rate_dwells import OUTPUT, POWER, RATE, START, TEMPERATURE, TIME, TURNS
from insenv.core.rate_test import Dwell, Flagged, LineFit, RateLineResult, Valued
from insenv.core.recording import Floats
from insenv.core.units import DEG

#: A table that turns less than this is at rest [rad/s].
REST = 0.005 * DEG
#: Rates nearer to each other than this [rad/s], and this share, are the same one of several power-ups.
SAME, SAME_SHARE = 0.02 * DEG, 1e-3
#: Limits of |z| for a pair of directions, and for one alone; fewest rates.
PAIR, ALONE, FEWEST = 5.0, 10.0, 10
#: More than the share of sound tests in which a rate is flagged. Simulated, 1e5 tests each of the published 34 rates
#: with one turn: white noise of 0.12 deg/sqrt(h) and an independent Gaussian spread from setting to setting of 0 to 5
#: deg/h, of which 1 deg/h has the most, 0.9e-3 (with every rate alone: 0.5e-3). Without any spread: none in 1e5.
FALSE_ALARM = 1e-3
RULE = (
    f"a rate is flagged if its mean over the power-ups is more than {PAIR:g} standard deviations off the robust line "
    f"in both directions ({ALONE:g} where the opposite was not measured) and more than half of the power-ups deviate "
    f"to the same side; the deviation is that of white noise and of the robust spread from setting to setting; with "
    f"fewer than {FEWEST} rates nothing is flagged"
)
#: Probability below which rests that scatter are interleaved.
DRIFT = 0.01


def result(dwells: Floats, noise: float, zeros: str, earth_rate: float) -> RateLineResult | None:
    """What the dwells, shape (d, `estimators.rate_dwells.WIDTH`), tell, with the white noise [rad/sqrt(s)].

    None where there are no two rates to draw a line through.
    """
    made = [_dwell(row, noise) for row in dwells]
    rests = [d for d in made if abs(d.rate) < REST]
    method, reason = _method(rests, zeros)
    level = _level(rests, method)
    points = [p for d in made if (p := _point(d, rests, method)) is not None]
    rates = _rates(points)
    if len(rates) < 2:
        return None
    table, white = _table(points, rates)
    means, variance = _means(table, white)
    tukey, d = rate_line_fits.robust(rates, means, variance, np.ones(len(rates), bool), weighed=False)
    flagged = _flags(rates, (means, variance, d), table, tukey)
    at = {f.rate for f in flagged}
    off = np.array([rate in at for rate in rates])
    bias = (level, earth_rate)
    fits = tuple(_fits(rates, (means, variance), off, bias, 0))
    each = tuple(
        fit
        for q in range(table.shape[0])
        for fit in _fits(*_there(rates, table[q], white[q], off), bias, int(points[0].power_up) + q)
    )
    setting = float(np.sqrt(np.median([_setting(rates, table[q], white[q]) for q in range(table.shape[0])])))
    spread = [replace(p, sd=float(np.hypot(p.sd, setting))) for p in points]
    repeats = {
        name: _repeatability([f for f in each if f.method == name]) for name in dict.fromkeys(f.method for f in fits)
    }
    return RateLineResult(
        tuple(spread), tuple(rests), method, reason, fits, each, flagged, RULE, FALSE_ALARM, repeats, noise, setting,
        earth_rate,
    )  # fmt: skip


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


def _method(rests: list[Dwell], wanted: str) -> tuple[str, str]:
    """How the static output is taken off, and why."""
    if not rests:
        return "none", "the table never rested"
    if wanted != "auto":
        return wanted, "as asked for"
    square, freedom = 0.0, 0
    for mine in _by_power_up(rests).values():
        if len(mine) > 2:
            w = np.array([r.sd**-2 for r in mine if r.sd > 0] or [1.0])
            y = np.array([r.output for r in mine if r.sd > 0] or [0.0])
            square += float((w * (y - (w * y).sum() / w.sum()) ** 2).sum())
            freedom += len(y) - 1
    if not freedom:
        return "ends", "a power-up has no rest between its first and its last"
    from scipy.special import chdtrc  # slow to import

    p = float(chdtrc(freedom, square))
    if p < DRIFT:
        return "interleaved", f"the rests scatter more than their noise (p = {p:.2g})"
    return "ends", f"the rests scatter no more than their noise (p = {p:.2g})"


def _by_power_up(dwells: list[Dwell]) -> dict[int, list[Dwell]]:
    groups: dict[int, list[Dwell]] = {}
    for d in dwells:
        groups.setdefault(d.power_up, []).append(d)
    return {q: sorted(group, key=lambda d: d.start) for q, group in groups.items()}


def _level(rests: list[Dwell], method: str) -> tuple[Valued, bool]:
    """Mean static output that was taken off, over the power-ups, and whether any was."""
    if method == "none":
        return Valued(0.0, 0.0), False
    used = [
        [mine[0], mine[-1]] if method == "ends" and len(mine) > 1 else mine for mine in _by_power_up(rests).values()
    ]
    means = [np.mean([r.output for r in mine]) for mine in used]
    variances = [np.mean([r.sd**2 for r in mine]) / len(mine) for mine in used]
    return Valued(float(np.mean(means)), float(np.sqrt(np.mean(variances) / len(used)))), True


def _point(d: Dwell, rests: list[Dwell], method: str) -> Dwell | None:
    """A dwell with its static output; None for a rest that is itself taken for it."""
    mine = sorted((r for r in rests if r.power_up == d.power_up), key=lambda r: r.start) or rests
    at_rest = abs(d.rate) < REST
    if method == "none":
        return replace(d, rate=0.0 if at_rest else d.rate)
    if method == "ends":
        if at_rest and (d == mine[0] or d == mine[-1]):
            return None
        return replace(d, rate=0.0 if at_rest else d.rate, zero=0.5 * (mine[0].output + mine[-1].output))
    if at_rest:
        return None
    middle = [r.start + 0.5 * r.duration for r in mine]
    now = d.start + 0.5 * d.duration
    shares = np.array([np.interp(now, middle, row) for row in np.eye(len(mine))])
    zero = float(shares @ [r.output for r in mine])
    return replace(d, zero=zero, sd=float(np.sqrt(d.sd**2 + (shares**2) @ [r.sd**2 for r in mine])))


def _rates(points: list[Dwell]) -> Floats:
    """The different rates, ascending, each the mean of its dwells."""
    rates = np.sort([p.rate for p in points])
    if not len(rates):
        return rates
    new = np.diff(rates) > SAME + SAME_SHARE * np.abs(rates[1:])
    return np.array([group.mean() for group in np.split(rates, np.flatnonzero(new) + 1)])


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


def _there(
    rates: Floats, y: Floats, white: Floats, off: NDArray[np.bool_]
) -> tuple[Floats, tuple[Floats, Floats], NDArray[np.bool_]]:
    """The rates that one power-up has."""
    has = np.isfinite(y)
    return rates[has], (y[has], white[has]), off[has]


def _flags(rates: Floats, measured: tuple[Floats, Floats, Floats], table: Floats, tukey: Floats) -> tuple[Flagged, ...]:
    """The rates that deviate by the rule; ``measured``: means, variances of their noise, spread of the settings."""
    if len(rates) < FEWEST:
        return ()
    means, white, d = measured
    fit = rate_line_fits.line(rates, means, tukey, white)
    left = fit.residual(rates, means)
    quiet = rate_line_fits.setting_spread(left, white, white <= np.median(white))
    z = left / np.sqrt(white + np.maximum(d, quiet) + 1e-30)
    each = table - fit.k * rates - fit.f0
    each = each - np.nanmedian(each, axis=1)[:, None]
    same_side = np.nansum(np.sign(each) == np.sign(left), axis=0) > 0.5 * np.isfinite(each).sum(axis=0)
    found = []
    for j, rate in enumerate(rates):
        other = int(np.abs(rates + rate).argmin())
        paired = other != j and abs(rates[other] + rate) < SAME + SAME_SHARE * abs(rate)
        strong = min(abs(z[j]), abs(z[other])) > PAIR if paired else abs(z[j]) > ALONE
        if strong and same_side[j]:
            found.append(Flagged(float(rate), float(left[j]), float(z[j])))
    return tuple(found)


def _setting(rates: Floats, y: Floats, white: Floats) -> float:
    has = np.isfinite(y)
    _, d = rate_line_fits.robust(rates[has], y[has], white[has], np.ones(int(has.sum()), bool), weighed=False)
    return float(d)


def _fits(
    rates: Floats,
    measured: tuple[Floats, Floats],
    off: NDArray[np.bool_],
    bias: tuple[tuple[Valued, bool], float],
    power_up: int,
) -> Iterator[LineFit]:
    """The lines by all methods; none where there are not two rates."""
    y, white = measured
    if len(rates) < 2:
        return
    every = np.ones(len(rates), bool)
    tukey, d = rate_line_fits.robust(rates, y, white, every, weighed=False)
    variance = white + d
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
