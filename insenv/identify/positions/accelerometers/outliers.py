r"""Rests that fit no triad: what was read there is left out of every fit.

With theta the fit of the kept rests, s^2 their variance on nu degrees of freedom, C the inverse of their information
and j the derivatives of a rest's magnitude, one that is left out is off by r, and is none of them if

    r^2 / s^2 / (1 + j' C j)  ~  F(1, nu)        has a probability below `OUTLIER` among all rests

They are taken one after the other, the worst first. Two that are far off hide each other, and sound ones look worse: so
where what is left still is more than any instrument leaves, the h rests that fit each other best are sought instead
(least trimmed squares), from random few by concentration steps: fit them, keep the h that this fit foretells best.

Source: P. J. Rousseeuw and K. Van Driessen, Computing LTS regression for large data sets, Data Mining and Knowledge
Discovery 12 (2006) 29.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from insenv.core.recording import Floats
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.checks.bent import UNLIKE
from insenv.identify.positions.evidence import MOST_OUTLIERS, OUTLIER
from insenv.identify.positions.least_squares import Fit, solve

#: Least freedom of a fit that is asked for outliers.
FREEDOM = 6
#: Random beginnings of the search for rests that fit each other, and concentration steps of each: of two rests of 26
#: that are off, and nine unknowns, one of a dozen beginnings is clean but for 2 %, and the steps cleanse others.
STARTS, STEPS = 12, 2


def outliers(problem: Magnitudes, terms: Sequence[Any]) -> NDArray[np.bool_]:
    """Fitted rests that nothing explains, shape (rests,).

    Parameters
    ----------
    problem : Magnitudes
    terms : sequence
        All that may explain them.
    """
    left, fit = _one_by_one(problem, terms)
    if fit.freedom < FREEDOM or (_credible(fit) and fit.variance < UNLIKE**2):
        return left
    hidden = _by_the_others(problem, terms)
    return left if hidden is None else hidden


def _one_by_one(problem: Magnitudes, terms: Sequence[Any]) -> tuple[NDArray[np.bool_], Fit]:
    """The rests that are left out one after the other, the worst first, and the fit of the others."""
    left = np.zeros(len(problem.fitted), dtype=bool)
    fit = solve(problem, terms)
    for _ in range(int(MOST_OUTLIERS * problem.fitted.sum())):
        if fit.freedom < FREEDOM:
            break
        own = fit.residual[:, 0] ** 2 / (1 - np.minimum(_leverage(fit), 1 - 1e-9))
        with np.errstate(over="ignore"):  # of one beside which nothing is left it is beyond all numbers
            ratio = own / (np.maximum(fit.rss - own, 1e-300) / (fit.freedom - 1))
        worst = int(np.argmax(np.where(problem.fitted & ~left, ratio, -1.0)))
        if float(fdtrc(1, fit.freedom - 1, ratio[worst])) * (problem.fitted & ~left).sum() > OUTLIER:
            break
        left[worst] = True
        fit = _fit(problem, terms, problem.fitted & ~left)
    # Beside a rest that is far off others look worst: what is not odd to the fit of the others comes back.
    back = left & ~_odd(fit, problem.fitted & ~left)
    return (left & ~back, _fit(problem, terms, problem.fitted & ~left | back)) if back.any() else (left, fit)


def _odd(fit: Fit, kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rests other than the ``kept`` ones, shape (rests,), that the fit of these does not foretell."""
    ratio = fit.residual[:, 0] ** 2 / max(fit.variance, 1e-300) / (1 + _leverage(fit))
    return ~kept & (fdtrc(1, max(fit.freedom, 1), ratio) * len(kept) < OUTLIER)


def _by_the_others(problem: Magnitudes, terms: Sequence[Any]) -> NDArray[np.bool_] | None:
    """The rests that those which fit each other best do not foretell; None where these miss gravity as well."""
    used = np.flatnonzero(problem.fitted)
    few = sum(term.size for term in terms) + FREEDOM // 2
    most = len(used) - int(MOST_OUTLIERS * len(used))
    if not few < most < len(used):
        return None
    rng = np.random.default_rng(0)
    fits = (_concentrated(problem, terms, rng.choice(used, few, replace=False), most) for _ in range(STARTS))
    kept, fit = min(fits, key=lambda one: one[1].rss if _credible(one[1]) else np.inf)
    if not _credible(fit) or fit.variance >= UNLIKE**2 or fit.freedom < 1:
        return None
    return problem.fitted & _odd(fit, kept)


def _concentrated(
    problem: Magnitudes, terms: Sequence[Any], start: NDArray[np.int64], most: int
) -> tuple[NDArray[np.bool_], Fit]:
    """The ``most`` rests that fit each other best from a ``start``, shape (rests,), and their fit."""
    kept = np.isin(np.arange(len(problem.fitted)), start)
    fit = _fit(problem, terms, kept)
    for _ in range(STEPS):
        off = np.where(problem.fitted, np.abs(fit.residual[:, 0]), np.inf)
        kept = np.isin(np.arange(len(off)), np.argsort(off)[:most])
        fit = _fit(problem, terms, kept)
    return kept, fit


def _credible(fit: Fit) -> bool:
    """Whether no coefficient is beyond what is credible: a bias without end makes all magnitudes alike."""
    most = [max(param.bound for param in term.effect.linear) for term in fit.terms]
    return all(np.all(np.abs(fit.theta[fit.of(t)]) <= one) for t, one in zip(fit.terms, most, strict=True))


def _fit(problem: Magnitudes, terms: Sequence[Any], kept: NDArray[np.bool_]) -> Fit:
    return solve(replace(problem, fitted=kept), terms)


def _leverage(fit: Fit) -> Floats:
    rows = fit.slopes[:, 0]
    return np.asarray(np.einsum("np,pq,nq->n", rows, fit.told, rows))
