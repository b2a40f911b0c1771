"""What an effect of nearly the right shape leaves in the other parameters.

An instrument follows no textbook's curve to the last digit. Beside an effect with a curve stands a smooth discrepancy
in what the curve depends on, B b with b ~ N(0, tau^2), whose size tau the data say by restricted maximum likelihood:
with C the whitened B beside the model X, and r the whitened residual,

    l(tau) = -1/2 log |I + tau^2 C'C| + 1/2 r' C (C'C + I / tau^2)^-1 C' r

Where the shape is right tau is zero, or nearly. Else the parameters would be others with the discrepancy fitted, by
-G b, G = (X'X)^-1 X'B, and less certain: their variance grows by the square of that and by G cov(b) G'.

Source: M. C. Kennedy and A. O'Hagan, Journal of the Royal Statistical Society B 63 (2001) 425.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.base import CurveEffect, Effect
from insenv.effects.spline import Spline, SplineRate, SplineTemperature, SplineTime
from insenv.identify.fit.gls import Fit, spectrum, whitened_rows
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem, Term

#: Sizes of the discrepancy that are tried, in that at which it is as large as the noise.
SIZES = np.concatenate([[0.0], np.geomspace(0.1, 100.0, 25)])


def added_variance(problem: Problem, fit: Fit, terms: Iterable[Term]) -> Floats:
    """What the variance of each scaled coefficient of ``fit`` grows by for the shapes of ``terms``, shape (p,)."""
    grown = np.zeros(len(fit.design.scale))
    for kind, by_rate in dict.fromkeys(curve for term in terms if (curve := _curve(term.effect)) is not None):
        columns = _columns(problem, kind, by_rate)
        if columns is not None:
            grown = grown + _one(problem, fit, columns)
    return grown


def _curve(effect: Effect) -> tuple[type[Spline], bool] | None:
    """What a discrepancy of the effect depends on, and whether it is a share of the input rate.

    A part of the linear model has none: it is the straight line through whatever curve an instrument follows.
    """
    if effect.generic or effect.exact or effect.part or not (isinstance(effect, CurveEffect) or effect.of_rate):
        return None
    if effect.of_time:
        return SplineTime, effect.of_rate
    if "temperature" in effect.needs:
        return SplineTemperature, effect.of_rate
    return (SplineRate, False) if effect.of_rate else None


def _columns(problem: Problem, kind: type[Spline], by_rate: bool) -> Floats | None:
    """The discrepancy's regressors in the modes of the fitted blocks, shape (modes, k)."""
    curve = kind().over_all(e.motion for e in problem.exposures)
    if any(curve.missing(e.motion) for e in problem.exposures):
        return None
    cells = tuple(curve.basis(e.u, e.motion) * (e.u[:, None] if by_rate else 1.0) for e in problem.exposures)
    return transform(problem.fitted, problem.bins.mean(cells))


def _one(problem: Problem, fit: Fit, columns: Floats) -> Floats:
    model, data = whitened_rows(problem, fit.design, fit.noise.power)
    white = columns / np.sqrt(spectrum(problem, fit.noise.power))[:, None]
    b = np.vstack([white, np.zeros((model.shape[1], columns.shape[1]))])
    q, upper = np.linalg.qr(model)
    c = b - q @ (q.T @ b)
    size, vectors = np.linalg.eigh(c.T @ c)
    kept = size > 1e-9 * size.max(initial=1e-300)
    size, vectors = size[kept], vectors[:, kept]
    score = vectors.T @ (c.T @ (data - q @ (q.T @ data)))
    powers = SIZES**2 / np.median(size) if len(size) else SIZES[:1]
    ratio = powers[:, None] * size
    likelihood = 0.5 * np.sum(powers[:, None] * score**2 / (1 + ratio) - np.log1p(ratio), axis=1)
    power = float(powers[np.argmax(likelihood)])
    if power == 0:
        return np.zeros(model.shape[1])
    gain = np.linalg.solve(upper, q.T @ b) @ vectors
    variance = power / (1 + power * size)
    shift = gain @ (variance * score)
    return shift**2 + gain**2 @ variance
