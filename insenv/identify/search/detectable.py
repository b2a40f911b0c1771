"""The smallest effect that a search would have found: what "not significant" is worth.

An effect of amplitude A has the whitened norm A w beside the model, w^2 = c' P c for its unit regressor c (`scan`). The
likelihood ratio then is about non-central chi-square with A^2 w^2, less what the noise, fitted anew, takes up,

    ratio = nu log(1 + chi^2_d(A^2 w^2) / nu),

and the held-out data add Student's t of nu degrees about A w_h, w_h^2 = phi' V^-1 phi (`evidence`). A is the amplitude
at which the joint deviate, corrected for the looks of this very search, passes the level in 95 % of recordings. Of
several coefficients (cosine and sine) it is the amplitude in the least visible direction; of several shapes that of the
median one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr, ndtri, ndtri_exp

from insenv.core.recording import Floats
from insenv.core.series.tails import log_tails_of_f, log_tails_of_t
from insenv.identify.findings import Detectable
from insenv.identify.fit.evidence import HELD_OUT_SPREAD, held_out_information
from insenv.identify.fit.gls import Fit, noise_freedom, whitened
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.search.scan import TOLD_APART, Hit

#: Probability with which an effect of the amplitude stated is found.
POWER = 0.95
#: Shapes of an effect that are looked at, evenly over its grid.
SHAPES = 5
#: Freedom of the noise at least: where it came out as less, the noise of a recording with the effect tells more.
LEAST_FREEDOM = 8.0
#: Whitened norm beyond which nothing is said: so few slow modes tell the noise that it would take up any of it.
STRONGEST = 60.0
#: Quantiles of a normal deviate that stand for the chance of a recording, in each of two directions.
_CHANCES = ndtri((np.arange(24) + 0.5) / 24)


@dataclass(frozen=True)
class _Seen:
    """A term in its least visible direction: information of the fitted data, and freedom of the noise there."""

    term: Term
    direction: Floats
    information: float
    freedom: float


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """A fitted model as what new effects are measured against."""

    problem: Problem
    fit: Fit

    @cached_property
    def _white(self) -> tuple[Floats, Floats]:
        weight, q, _ = whitened(self.problem, self.fit)
        return weight, q

    def smallest(self, hit: Hit, alpha: float) -> Detectable | None:
        """The smallest amplitude of the hit's effect that is found; None where its size is no single number."""
        if hit.candidate.generic:
            return None
        if len({p.unit for p in hit.candidate.effect.linear}) > 1:
            return None
        terms = hit.candidate.terms
        middle = np.unique(np.linspace(0, len(terms) - 1, SHAPES + 2).astype(int)[1:-1])
        chosen = [terms[i] for i in middle] if len(terms) > 1 else [hit.term]
        seen = [one for term in chosen if (one := self._seen(term)) is not None]
        if not seen:
            return None
        one = sorted(seen, key=lambda s: s.information)[len(seen) // 2]
        need = -float(ndtri_exp(np.log(alpha / hit.looks)))
        ratio = float(np.sqrt(self._held_out(one.term, one.direction) / one.information))
        strength = _strength(need, len(one.direction), one.freedom, ratio)
        if strength > 0.99 * STRONGEST:
            return None
        name, unit, _ = self.problem.names(one.term)[0]
        at = {
            p.name: (x, p.unit_on(self.problem.unit))
            for p, x in zip(one.term.effect.shapes, one.term.shape, strict=True)
        }
        single = len(one.term.effect.linear) == 1
        value = strength / float(np.sqrt(one.information))
        return Detectable(name.partition("[")[0] if single else "amplitude", value, unit, at)

    def _seen(self, term: Term) -> _Seen | None:
        """How the fitted data see a unit amplitude of ``term``; None where it is not told from the model."""
        weight, q = self._white
        columns = self.problem.transformed(term) * weight[:, None]
        fresh = columns - q @ (q.T @ columns)
        information, directions = np.linalg.eigh(fresh.T @ fresh)
        direction = directions[:, 0]
        whole = float(np.sum((columns @ direction) ** 2))
        if information[0] <= TOLD_APART**2 * whole or not whole:
            return None
        freedom = noise_freedom(self.problem, self.fit.noise.power, (fresh @ direction) ** 2)
        return _Seen(term, direction, float(information[0]), freedom)

    def _held_out(self, term: Term, direction: Floats) -> float:
        """Information of the held-out data on a unit amplitude."""
        problem, design = self.problem, self.fit.design
        weight, _ = self._white
        new = problem.columns(term) @ direction
        if design.matrix.shape[1]:
            own = design.transformed * weight[:, None]
            moved = np.linalg.lstsq(own, weight * (problem.transformed(term) @ direction), rcond=None)[0]
            new = new - design.matrix @ (moved * (design.term >= 0))
        return held_out_information(problem, self.fit, new)


def _strength(need: float, d: int, freedom: float, ratio: float) -> float:
    """Whitened norm on the fitted data at which the joint deviate exceeds ``need`` with probability `POWER`.

    ``ratio`` is the whitened norm on the held-out data as a share of it.
    """
    freedom = max(freedom, LEAST_FREEDOM)
    grid, sizes = np.geomspace(1e-2, 4e3, 200), np.linspace(0, 60, 200)
    tail = log_tails_of_t(sizes, freedom)
    normal = -ndtri_exp(np.minimum(np.where(np.isfinite(tail), tail, log_ndtr(-sizes)), -1e-12))
    deviates = -ndtri_exp(np.minimum(_log_tail(freedom * np.log1p(grid / freedom) / d, d, freedom), -1e-12))
    a, b = (x.ravel() for x in np.meshgrid(_CHANCES, _CHANCES))

    def reached(strength: float) -> float:
        # The direction of the effect is normal; what the others of d coefficients gain by chance is taken at its mean.
        fitted = np.interp((strength + a) ** 2 + d - 1, grid, deviates)
        # The smaller model's noise, with which the held-out data are weighed, has taken up some of the effect.
        z = (ratio * strength + b) / HELD_OUT_SPREAD / np.sqrt(1 + strength**2 / freedom)
        held = np.copysign(np.interp(np.abs(z), sizes, normal), z)
        joint = (fitted + ratio * held) / np.sqrt(1 + ratio**2)
        return float(np.quantile(joint, 1 - POWER)) - need

    low, high = 0.5, STRONGEST
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reached(middle) < 0 else (low, middle)
    return high


def _log_tail(ratio: Floats, d: int, freedom: float) -> Floats:
    """Logarithm of the tail of Fisher's F, by its normal limit where that cannot be computed."""
    log_tail = log_tails_of_f(ratio, d, freedom)
    return np.where(np.isfinite(log_tail), log_tail, log_ndtr(-np.sqrt(ratio * d)))
