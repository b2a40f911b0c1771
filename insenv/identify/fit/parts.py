r"""Whether the gain is the same in the parts of a recording: runs, or quarters of what tells it.

With a scale factor g_k +- s_k of its own in each of K parts, all else in common, what the parts scatter beyond chance
is no noise that the fit knows of (a reference of another lag or slip in each part, another temperature, another unit):

    var(g) += t^2 / K,      t^2 the variance between them (`insenv.identify.fit.scatter`)

Each s_k has what the response of the reference adds, and is larger where what is left differs from swing to swing
(`insenv.identify.fit.swings`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.identify.fit.gls import Fit, spectrum
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.reference_variance import beside_response
from insenv.identify.fit.scatter import scatter
from insenv.identify.fit.swings import by_swings

#: Parts of a single run, and the fewest bins of one.
PARTS, FEWEST = 4, 12
#: Chance of a scatter from which on it counts in part, and below which it counts in full.
CHANCE, NO_CHANCE = 0.1, 0.025


@dataclass(frozen=True)
class PartsApart:
    """Coefficients of the parts with their deviations, the chance of their scatter, and the variance between them.

    ``times`` are those of the parts [s], weighted with what tells the coefficient.
    """

    values: Floats
    deviations: Floats
    chance: float
    between: float
    times: Floats

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
    white = 1 / np.sqrt(spectrum(problem, fit.noise.power))
    columns = problem.columns(term) * (label[:, None] == np.arange(label.max() + 1))
    others = np.delete(fit.design.transformed, own, axis=1)
    matrix = np.column_stack([transform(problem.fitted, columns), others]) * white[:, None]
    size = np.linalg.norm(matrix, axis=0)
    if not size.all():
        return None
    scaled, k = matrix / size, columns.shape[1]
    prior = np.concatenate([np.full(k, 1 / problem.priors(term)[0] ** 2), np.delete(fit.design.prior, own)])
    inverse = np.linalg.inv(scaled.T @ scaled + np.diag(prior / size**2))
    data, weights = problem.data() * white, scaled @ inverse
    values, left = weights.T @ data / size, data - scaled @ (weights.T @ data)
    beside = beside_response(problem, fit)
    added = float(beside.added[own[0]]) / fit.design.scale[own[0]] ** 2 if beside else 0.0
    variance = np.array([by_swings(problem, w, left)[0] for w in weights.T[:k]]) * np.diag(inverse)[:k] / size[:k] ** 2
    deviations = np.sqrt(variance + added)
    found = scatter(values[:k], deviations)
    weight = np.where(problem.bins.held_out[:, None], 0.0, columns**2)
    times = problem.bins.time @ weight / np.maximum(weight.sum(axis=0), 1e-300)
    return PartsApart(values[:k], deviations, found.chance, found.between, times)


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
