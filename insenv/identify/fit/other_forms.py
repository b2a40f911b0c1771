"""What another form of an effect's curve would make of the other parameters.

Nobody knows whether a local fault is a Gaussian or a resonance, and the wings of one look like a scale factor. With the
term in its other form, at the shapes that are best there, the parameters are theta' and the whitened residuals S';
with it as it was found theta and S. The other form has the probability

    w = 1 / (1 + exp((S' - S) / 2)),        and the variance of parameter j grows by w (theta'_j - theta_j)^2

Source: J. A. Hoeting et al., Bayesian model averaging: a tutorial, Statistical Science 14 (1999) 382, for two models of
equal prior probability, the parameters told being those of the first.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from insenv.core.recording import Floats
from insenv.identify.fit.gls import Fit, whitened_rows
from insenv.identify.fit.problem import Model, Problem, Term, design

#: Tries of the shapes of the other form, and the first step in the smallest of them.
TRIES, STEP = 60, 0.3


def added_variance(problem: Problem, fit: Fit, terms: Iterable[Term]) -> Floats:
    """What the variance of each coefficient of ``fit`` (SI) grows by for the other forms of ``terms``, shape (p,)."""
    grown = np.zeros(len(fit.design.scale))
    for term in terms:
        if not term.shape or term not in fit.model:
            continue
        index = fit.model.index(term)
        for effect in term.effect.others():
            other = replace(term, effect=effect)
            key = ("other form", fit.model, fit.noise.power.tobytes(), index, other)
            change, weight = problem.remember(key, lambda i=index, o=other: _instead(problem, fit, i, o))
            grown += weight * np.where(fit.design.term == index, 0.0, change) ** 2
    return grown


def _instead(problem: Problem, fit: Fit, index: int, other: Term) -> tuple[Floats, float]:
    """Change of each coefficient with ``other`` in the place of the term ``index``, and the probability of it."""
    start = np.array(other.shape)
    step = STEP * float(np.abs(start).min())
    rest = (*fit.model[:index], *fit.model[index + 1 :])

    def at(x: Floats) -> Term:
        return replace(other, shape=tuple(map(float, start + step * x)))

    def loss(x: Floats) -> float:
        lowest = [p.low for p in other.effect.shapes]
        if np.any(start + step * x <= np.maximum(lowest, 0.0)):
            return np.inf
        left = _solved(problem, fit, (*rest, at(x)))[1]  # the last one, so that the others are stacked once
        problem.forget(at(x))
        return left

    best = minimize(loss, np.zeros(len(start)), method="Nelder-Mead", options={"maxfev": TRIES, "xatol": 0.02})
    changed = (*fit.model[:index], at(best.x), *fit.model[index + 1 :])
    before, after = _solved(problem, fit, fit.model), _solved(problem, fit, changed)
    if len(after[0]) != len(before[0]):
        return np.zeros(len(before[0])), 0.0
    return after[0] - before[0], float(expit(0.5 * (before[1] - after[1])))


def _solved(problem: Problem, fit: Fit, model: Model) -> tuple[Floats, float]:
    """Coefficients (SI) of a model with the noise of ``fit``, and its whitened sum of squares."""
    columns = design(problem, model)
    rows, data = whitened_rows(problem, columns, fit.noise.power)
    theta = np.linalg.lstsq(rows, data, rcond=None)[0]
    return theta / columns.scale, float(np.sum((data - rows @ theta) ** 2))
