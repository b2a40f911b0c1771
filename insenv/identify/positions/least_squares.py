"""Least squares of rests and turns: residuals of units, the fit of terms to them, and its inverse information."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from insenv.core.recording import Floats

#: Most steps of a fit.
STEPS = 60
#: Relative gain that a step must promise.
ARRIVED = 1e-9
#: Smallest share of a step that is tried.
LEAST_SHARE = 1e-2
#: Below this freedom the variance of Student's t says nothing any more: its tails have it, or there is none.
LEAST_T = 4


class Problem(Protocol):
    """Residuals of m units (rests, turns), d components each, of which ``rank`` are independent.

    ``nuisance`` are prior standard deviations of unknowns that are no effects. Residuals are whitened, held-out units
    last: theirs have no noise in common with those of the fitted ones. A unit that is fitted and held out as well is
    held out in its turn.
    """

    @property
    def fitted(self) -> NDArray[np.bool_]:
        """Units to fit, shape (m,)."""

    @property
    def held_out(self) -> NDArray[np.bool_]:
        """Units to score, shape (m,)."""

    @property
    def rank(self) -> int:
        """Independent components of each unit."""

    @property
    def nuisance(self) -> Floats:
        """Prior standard deviations of further unknowns, shape (q,)."""

    @property
    def spread(self) -> float:
        """Spread that the deviate of units is taken to have: more than 1 where noise is common to all."""

    def evaluate(self, terms: Sequence[Any], theta: Floats) -> tuple[Floats, Floats]:
        """Residuals, shape (m, d), and their derivatives, shape (m, d, p)."""

    def begin(self, terms: Sequence[Any]) -> Floats:
        """Where a fit begins: coefficients, then further unknowns, shape (p + q,)."""

    @property
    def root(self) -> Floats:
        """L of the noise's covariance s^2 L L', shape (m d, m d)."""

    def plain(self, residual: Floats) -> Floats:
        """Residuals before they were whitened, shape (m, d), or of k sets at once (m, d, k)."""


def in_turn(problem: Problem) -> bool:
    """Whether each unit is fitted, and held out in its turn."""
    return bool((problem.fitted & problem.held_out).any())


@dataclass(frozen=True)
class Fit:
    """A fit of ``terms``: parameters, residuals of all units and their derivatives, RSS and freedom of the fitted.

    ``over_noises`` are standard deviations where the shape of the noise is an estimate too.
    """

    terms: tuple[Any, ...]
    theta: Floats
    residual: Floats
    slopes: Floats
    rss: float
    freedom: int
    inverse: Floats
    over_noises: Floats | None = None

    @property
    def variance(self) -> float:
        """Of one component, from the scatter of the fitted units."""
        return self.rss / max(self.freedom, 1)

    def sd(self) -> Floats:
        """Standard deviations, shape (p,): wider where the scatter is known with little freedom (Student's t).

        Half of an interval of 95 % over 1.96. A t of 4 and more has a variance of nu / (nu - 2), which comes to that.
        """
        if self.over_noises is not None:
            return self.over_noises
        nu = max(self.freedom, 1)
        wider = np.sqrt(nu / (nu - 2)) if nu >= LEAST_T else float(stdtrit(nu, 0.975)) / float(ndtri(0.975))
        return np.asarray(np.sqrt(np.diag(self.inverse) * self.variance) * wider, float)

    @property
    def told(self) -> Floats:
        """The inverse with nothing of coefficients that the rows do not tell: they move no residual."""
        known = np.all(np.isfinite(self.inverse), axis=0)[:, None]
        return np.where(known & known.T, self.inverse, 0.0)

    def of(self, term: Any) -> slice:
        """Where the coefficients of a term stand."""
        start = sum(t.size for t in self.terms[: self.terms.index(term)])
        return slice(start, start + term.size)


def solve(problem: Problem, terms: Sequence[Any]) -> Fit:
    """Least squares by Gauss and Newton with halved steps, from where the problem begins or from zero."""
    fitted = problem.fitted
    weight = 1 / problem.nuisance
    p = sum(term.size for term in terms)
    theta = np.zeros(p + len(weight))

    def rss(residual: Floats, at: Floats, scale: float) -> float:
        return float(np.sum(residual[fitted] ** 2) + scale * np.sum((at[p:] * weight) ** 2))

    residual, slopes = problem.evaluate(terms, theta)
    begin = problem.begin(terms)
    other, other_slopes = problem.evaluate(terms, begin)
    if rss(other, begin, 0.0) < rss(residual, theta, 0.0):
        theta, residual, slopes = begin, other, other_slopes
    # A prior weighs against the noise, which the residual shows.
    scale = _scale(problem, residual, 0)
    for _ in range(STEPS):
        rows, right = normal(problem, residual, slopes, theta, scale)
        step, promised = _step(rows, right)
        best = rss(residual, theta, scale)
        if promised <= ARRIVED * best:
            break
        share = 1.0
        while True:
            tried = theta + share * step
            new, new_slopes = problem.evaluate(terms, tried)
            if rss(new, tried, scale) < best or share < LEAST_SHARE:
                break
            share /= 4
        if not rss(new, tried, scale) < best:
            break
        theta, residual, slopes = tried, new, new_slopes
        scale = _scale(problem, residual, p) if len(weight) else scale
    rows, _ = normal(problem, residual, slopes, theta, scale)
    freedom = problem.rank * int(fitted.sum()) - p
    return Fit(tuple(terms), theta, residual, slopes, rss(residual, theta, scale), freedom, _inverse(rows))


def _step(rows: Floats, right: Floats) -> tuple[Floats, float]:
    """Step of Gauss and Newton, and the reduction of the sum of squares that it promises."""
    size = _sizes(rows)
    scaled = rows / size
    step = np.linalg.lstsq(scaled, -right, rcond=1e-10)[0]
    return step / size, float(right @ right - np.sum((right + scaled @ step) ** 2))


def _inverse(rows: Floats) -> Floats:
    """Inverse of the information, shape (p, p); infinite variance of a coefficient of which the rows say nothing."""
    size = _sizes(rows)
    scaled = rows / size
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    told = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)
    inverse = (vectors[:, told] / values[told]) @ vectors[:, told].T / np.outer(size, size)
    untold = np.sum(vectors[:, ~told] ** 2, axis=1) > 1e-9
    inverse[untold, untold] = np.inf
    return inverse


def _sizes(rows: Floats) -> Floats:
    size = np.linalg.norm(rows, axis=0)
    size[size < 1e-150] = 1.0  # of which no square is left
    return size


def _scale(problem: Problem, residual: Floats, p: int) -> float:
    freedom = max(problem.rank * int(problem.fitted.sum()) - p, 1)
    return float(np.sum(residual[problem.fitted] ** 2)) / freedom


def normal(problem: Problem, residual: Floats, slopes: Floats, theta: Floats, scale: float) -> tuple[Floats, Floats]:
    """Rows of the linearised problem and their right side: the fitted units, then the priors."""
    fitted = problem.fitted
    p, n = len(theta) - len(problem.nuisance), len(theta)
    rows = slopes[fitted].reshape(residual[fitted].size, n)
    prior = np.sqrt(scale) * np.eye(n)[p:] / problem.nuisance[:, None]
    return np.vstack([rows, prior]), np.concatenate([residual[fitted].ravel(), prior @ theta])
