r"""Whether the gain is the same in the parts of a recording: runs, or quarters of what tells it.

With a scale factor g_k +- s_k of its own in each of K parts, all else in common, what the parts scatter beyond chance
is no noise that the fit knows of (a reference of another lag or slip in each part, another temperature, another unit):

    var(g) += t^2 / K,      t^2 the variance between them (`insenv.identify.fit.scatter`)

Each s_k has what the response of the reference adds, and is larger where what is left differs from swing to swing
(`insenv.identify.fit.swings`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.identify.fit.gls import Fit, noise_beside, spectrum
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.reference_variance import beside_response
from insenv.identify.fit.scatter import scatter, scatter_of_correlated
from insenv.identify.fit.swings import by_swings

#: Parts of a single run, and the fewest bins of one.
PARTS, FEWEST = 4, 12
#: Chance of a scatter from which on it counts in part, and below which it counts in full.
CHANCE, NO_CHANCE = 0.1, 0.025


@dataclass(frozen=True)
class PartsApart:
    """Coefficients of the parts with their deviations, the chance of their scatter, and the variance between them.

    ``label`` is the part of each bin, and ``column`` the regressor over all bins, in each part the one that is exact
    there.
    """

    values: Floats
    deviations: Floats
    chance: float
    between: float
    label: NDArray[np.int64]
    column: Floats

    @property
    def added(self) -> float:
        """What the variance of the common one grows by: by degrees, for the chance of one recording is no threshold."""
        share = np.log(CHANCE / max(self.chance, 1e-300)) / np.log(CHANCE / NO_CHANCE)
        return float(np.clip(share, 0.0, 1.0)) * self.between / len(self.values)


def apart(problem: Problem, fit: Fit, term: Term) -> PartsApart | None:
    """How the coefficient of a term with one column scatters over the parts; None where there are not two.

    Parameters
    ----------
    problem : Problem
    fit : Fit
    term : Term
        Of the fit's model.
    """
    own = np.flatnonzero(fit.design.term == fit.model.index(term))
    label = _parts(problem, problem.columns(term)[:, 0])
    if len(own) != 1 or label.max() < 1:
        return None
    parts = label[:, None] == np.arange(label.max() + 1)
    told = _with_own(problem, fit, int(own[0]), (term,) * parts.shape[1], parts)
    if told is None:
        return None
    # Each where it is exact: a skew of its own, not that of all.
    terms = tuple(replace(term, effect=term.effect.near(value[None])) for value in told[0])
    if any(one != term for one in terms):
        told = _with_own(problem, fit, int(own[0]), terms, parts) or told
    values, covariance = told
    # Errors that they have in common make their differences surer than a shape that is right only nearly allows, and
    # those that go with a gain that changes less sure: they scatter where they do by either.
    alone, together = scatter(values, np.sqrt(np.diag(covariance))), scatter_of_correlated(values, covariance)
    found = max(alone, together, key=lambda one: one.chance)
    column = np.sum(np.column_stack([problem.columns(one) for one in terms]) * parts, axis=1)
    return PartsApart(values, np.sqrt(np.diag(covariance)), found.chance, found.between, label, column)


def _with_own(
    problem: Problem, fit: Fit, own: int, terms: tuple[Term, ...], parts: NDArray[np.bool_]
) -> tuple[Floats, Floats] | None:
    """Coefficients of each part's term in the place of the fit's column ``own``, (K,), with their covariance, (K, K).

    Beside a gain that changes the parts are told together with that, and differ less surely than each is known. Beside
    the noise that they leave: what they tell apart is a walk in that of the whole.
    """
    columns, k = np.column_stack([problem.columns(term) for term in terms]) * parts, len(terms)
    others = np.delete(fit.design.transformed, own, axis=1)
    matrix = np.column_stack([transform(problem.fitted, columns), others])
    size = np.sqrt(np.mean(matrix**2, axis=0))
    if not size.all():
        return None
    prior = np.concatenate([np.full(k, 1 / problem.priors(terms[0])[0] ** 2), np.delete(fit.design.prior, own)])
    power = noise_beside(problem, matrix / size, prior / size**2, restricted=True, start=fit.noise.power).power
    white = 1 / np.sqrt(spectrum(problem, power))
    matrix = matrix * white[:, None]
    size = np.linalg.norm(matrix, axis=0)
    scaled, data = matrix / size, problem.data() * white
    inverse = np.linalg.inv(scaled.T @ scaled + np.diag(prior / size**2))
    weights = scaled @ inverse
    values, left = weights.T @ data / size, data - scaled @ (weights.T @ data)
    beside = beside_response(problem, fit)
    added = float(beside.added[own]) / fit.design.scale[own] ** 2 if beside else 0.0
    swings = np.array([by_swings(problem, w, left)[0] for w in weights.T[:k]])
    factor = np.sqrt(swings) / size[:k]
    return values[:k], inverse[:k, :k] * np.outer(factor, factor) + added * np.eye(k)


def _parts(problem: Problem, column: Floats) -> NDArray[np.int64]:
    """Part of each bin, shape (bins,): its run among those that tell the gain, or a quarter of what tells it."""
    fitted = np.zeros(problem.bins.n, bool)
    for block in problem.fitted:
        fitted[block.start : block.stop] = True
    runs = [r for r in np.unique(problem.bins.run) if np.sum(fitted & (problem.bins.run == r)) >= FEWEST]
    if len(runs) > 1:
        return np.maximum(np.searchsorted(np.array(runs), problem.bins.run, side="right") - 1, 0)
    off = column - np.mean(column[fitted])
    told = np.cumsum(np.where(fitted, off**2, 0.0))
    if fitted.sum() < PARTS * FEWEST or told[-1] <= 0:
        return np.zeros(problem.bins.n, np.int64)
    return np.minimum((PARTS * told / told[-1]).astype(np.int64), PARTS - 1)
