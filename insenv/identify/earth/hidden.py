"""Effects that hide in the horizontal Earth rate, and what each would have to be to explain its magnitude.

An effect x that repeats with the table's angle as the Earth rate does goes into (c, s) and leaves no residual. With a
prior N(0, P) on x, a joint fit of model and x tells how they share (c, s), and the level is one more measurement,

    n'(c, s) = level,        n = (c, s) / |(c, s)| of the fit without x.

Along n the effect is then known, across n it is as uncertain as before. That |(c, s)| = level is a circle, not its
tangent, is part of the variance of that measurement: q^2 / (2 level) at a distance q across n.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.base import Effect, LinearEffect
from insenv.identify.fit.gls import Fit, coefficients, spectrum
from insenv.identify.fit.problem import Design, Problem, Term
from insenv.identify.search.earth_rate import Horizontal, Level, covariance, earth_places, horizontal
from insenv.identify.search.scan import TOLD_APART

#: An effect hides in the Earth rate where with it the standard deviation of the azimuth grows by this factor.
HIDES = 3.0
#: With a suspect in the model the magnitude agrees to so many standard deviations, at the bound of what is credible.
AGREES = 3.0


@dataclass(frozen=True)
class Hidden:
    """What an effect that hides in the Earth rate would have to be.

    Attributes
    ----------
    effect : Effect
    theta, sd : ndarray, shape (k,)
        Its parameters: the smallest that restore the level, with standard deviations that hold across n too.
    least, least_sd : float
        Size of the smallest parameters, and its standard deviation.
    turns : float
        How much one unit of it adds to the Earth rate across n at most [rad/s per unit].
    earth : Horizontal
        The Earth rate beside it.
    """

    effect: Effect
    theta: Floats
    sd: Floats
    least: float
    least_sd: float
    turns: float
    earth: Horizontal


def hidden(problem: Problem, fit: Fit, effects: tuple[Effect, ...], level: Level | None) -> tuple[Hidden, ...]:
    """Those of ``effects`` that this recording does not tell from the Earth rate, and what each would have to be.

    Without a level nothing is known of their size: ``theta`` is zero with the prior's standard deviation.
    """
    earth = horizontal(problem, fit)
    if earth is None:
        return ()
    found = (_hidden(problem, fit, e, earth, level) for e in effects if isinstance(e, LinearEffect))
    return tuple(one for one in found if one is not None)


def _hidden(problem: Problem, fit: Fit, effect: Effect, earth: Horizontal, level: Level | None) -> Hidden | None:
    params = problem.names(Term(effect))
    prior = np.array([sd for _, _, sd in params])
    freely = _Joint.of(problem, fit, effect, prior)
    if freely is None or not freely.across_sd(earth) > HIDES * np.sqrt(earth.across @ earth.cov @ earth.across):
        return None
    turns = freely.largest_turn(earth)
    if level is None:
        return Hidden(effect, np.zeros(len(prior)), prior, 0.0, 0.0, turns, earth)
    bound = np.array([problem.limits(p)[1] for p in effect.linear])
    wide = _Joint.of(problem, fit, effect, np.where(np.isfinite(bound), bound, prior))
    if wide is None or abs(wide.misfit(earth, level)) > AGREES:
        return None
    smallest = wide.measured(earth, level.value, level.sd)
    least, least_sd = smallest.size()
    # The circle |(c, s)| = level falls away from its tangent by q^2 / (2 level) at a distance q across.
    joint = freely if least <= prior.max() else _Joint.of(problem, fit, effect, np.maximum(prior, least))
    assert joint is not None
    curved = min(np.sqrt(0.75) * joint.across_sd(earth) ** 2 / level.value, level.value)
    after = joint.measured(earth, level.value, float(np.hypot(level.sd, curved)))
    # The mean is that of the sharp measurement: the smallest parameters; the width is the honest one.
    beside = replace(after.earth(), theta=smallest.earth().theta)
    return Hidden(effect, smallest.own(), after.own_sd(), least, least_sd, turns, beside)


@dataclass(frozen=True)
class _Joint:
    """A model and one more effect, fitted together with priors where the data do not tell them apart."""

    design: Design
    beta: Floats
    cov: Floats
    places: list[int]
    k: int

    @classmethod
    def of(cls, problem: Problem, fit: Fit, effect: Effect, prior: Floats) -> _Joint | None:
        """Columns of ``effect`` with prior standard deviations beside those of the fit; None where it has none."""
        term, base = Term(effect), fit.design
        columns, changed = problem.columns(term), _separable(problem, fit, problem.transformed(term))
        scale = np.sqrt(np.mean(changed**2, axis=0))
        if not scale.any():
            return None
        scale[scale == 0] = 1.0
        design = replace(
            base,
            matrix=np.column_stack([base.matrix, columns / scale]),
            transformed=np.column_stack([base.transformed, changed / scale]),
            scale=np.concatenate([base.scale, scale]),
            prior=np.concatenate([base.prior, (1 / (prior * scale)) ** 2]),
        )
        beta, cov = coefficients(problem, design, fit.noise.power)
        return cls(design, beta, cov, earth_places(base), len(prior))

    def measured(self, earth: Horizontal, value: float, sd: float) -> _Joint:
        """With one more measurement: the part of the Earth rate along n is ``value`` with ``sd``."""
        row = self._row(earth.along)
        spread = self.cov @ row
        gain = spread / (row @ spread + sd**2)
        beta = self.beta + gain * (value - row @ self.beta)
        return replace(self, beta=beta, cov=self.cov - np.outer(gain, spread))

    def misfit(self, earth: Horizontal, level: Level) -> float:
        """Departure of the level in standard deviations, with the effect beside it."""
        row = self._row(earth.along)
        return float((row @ self.beta - level.value) / np.sqrt(row @ self.cov @ row + level.sd**2))

    def across_sd(self, earth: Horizontal) -> float:
        """Standard deviation of the Earth rate across n [rad/s]."""
        row = self._row(earth.across)
        return float(np.sqrt(row @ self.cov @ row))

    def largest_turn(self, earth: Horizontal) -> float:
        """Most that one unit of the effect moves the Earth rate across n [rad/s]: regression of one on the other."""
        own = self._own_places()
        both = covariance(self.design, self.cov, own)
        shared = (self._row(earth.across) @ self.cov)[own] / self.design.scale[own]
        return float(np.linalg.norm(np.linalg.solve(both, shared)))

    def own(self) -> Floats:
        """Parameters of the effect, SI, shape (k,)."""
        return (self.beta / self.design.scale)[-self.k :]

    def own_sd(self) -> Floats:
        """Their standard deviations, shape (k,)."""
        return (np.sqrt(np.maximum(np.diag(self.cov), 0)) / self.design.scale)[-self.k :]

    def size(self) -> tuple[float, float]:
        """Length of the effect's parameters, and its standard deviation along them."""
        own = self._own_places()
        length = float(np.linalg.norm(self.own()))
        unit = self.own() / max(length, 1e-300)
        return length, float(np.sqrt(np.maximum(unit @ covariance(self.design, self.cov, own) @ unit, 0.0)))

    def earth(self) -> Horizontal:
        """The Earth rate beside the effect."""
        theta = (self.beta / self.design.scale)[self.places]
        return Horizontal(theta, covariance(self.design, self.cov, self.places))

    def _own_places(self) -> list[int]:
        """Columns of the effect."""
        return list(range(len(self.beta) - self.k, len(self.beta)))

    def _row(self, direction: Floats) -> Floats:
        """What the scaled coefficients are multiplied with to give the Earth rate in a direction, shape (p,)."""
        row = np.zeros(len(self.beta))
        row[self.places] = direction / self.design.scale[self.places]
        return row


def _separable(problem: Problem, fit: Fit, changed: Floats) -> Floats:
    """Transformed columns, without what of them lies outside the model by too little to be told from it."""
    root = np.sqrt(spectrum(problem, fit.noise.power))[:, None]
    q = np.linalg.qr(fit.design.transformed / root)[0]
    white = changed / root
    inside = q @ (q.T @ white)
    outside = np.linalg.norm(white - inside, axis=0) > TOLD_APART * np.linalg.norm(white, axis=0)
    return np.where(outside, changed, inside * root)
