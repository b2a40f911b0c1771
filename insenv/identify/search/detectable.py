"""The smallest effect that a search would have found: what "not significant" is worth.

An effect of amplitude A has the whitened norm A w beside the model, w^2 = c' P c for its unit regressor c (`scan`). The
likelihood ratio then is about non-central chi-square with A^2 w^2, less what the noise, fitted anew, takes up,

    ratio = nu log(1 + chi^2_d(A^2 w^2) / nu),

and the held-out data add Student's t of nu degrees about A w_h, w_h^2 = phi' V^-1 phi (`evidence`). A is the amplitude
at which the joint deviate, corrected for the looks of this very search, passes the level in 95 % of recordings. Of
several coefficients (cosine and sine) it is the amplitude in the least visible direction; of several shapes that of the
median one of those that are not taken for settling at the start.

Where a few slow modes tell the noise, a walk is fitted to most of a drift, and no one nu says what is left: of a drift
of 10 standard deviations in 72 means the likelihood ratio is 10, not 40. There the model without the effect is fitted
to the data that are to be expected: with the fitted variances S and a column c in each group of modes, the
cross-products

    E[y y'] = n S + A^2 c c',        E[x y] = A x c,

and its noise is what likelihood ratio, freedom and held-out deviate are computed with, as the search would.

An effect that is significant is not named without a size, nor where held-out data get worse, nor beyond what is
credible (`insenv.identify.search.size`, `insenv.identify.fit.heldout`): A is at least so many standard deviations,
shapes fitted beside it, that it has a size in 95 % of recordings too, and so large that the held-out data of this
recording confirm it. Where no credible one is, nothing is said.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr, ndtri, ndtri_exp

from insenv.core.recording import Floats
from insenv.core.series.tails import log_tails_of_f, log_tails_of_t
from insenv.identify.clean.bursts import settling_curve
from insenv.identify.clean.settling import settled_by
from insenv.identify.findings import Detectable
from insenv.identify.fit.evidence import HELD_OUT_SPREAD, held_out_information
from insenv.identify.fit.gls import Fit, coefficients, noise_freedom, spectrum, whitened
from insenv.identify.fit.heldout import CHANCE, residual
from insenv.identify.fit.noise import NoiseFit, Pooled, fit_noise
from insenv.identify.fit.problem import Problem, Term, design
from insenv.identify.fit.uncertainty import coefficients_of
from insenv.identify.search.scan import TOLD_APART, Hit
from insenv.identify.search.size import LEAST

#: Probability with which an effect of the amplitude stated is found.
POWER = 0.95
#: Shapes of an effect that are looked at, evenly over its grid.
SHAPES = 5
#: Freedom of the noise at least: where it came out as less, the noise of a recording with the effect tells more.
LEAST_FREEDOM = 8.0
#: Freedom from which on one nu says what noise that is fitted anew takes up.
MANY = 60.0
#: Whitened norms for which the answer is computed where there is less.
_STRENGTHS = (0.01, 3.0, 5.0, 7.0, 9.0, 12.0, 16.0, 22.0, 30.0, 42.0, 60.0)
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
        seen = [one for term in self._shapes(hit) if (one := self._seen(term)) is not None]
        if not seen:
            return None
        one = sorted(seen, key=lambda s: s.information)[len(seen) // 2]
        need = -float(ndtri_exp(np.log(alpha / hit.looks)))
        strength = self._strength(one, need)
        if strength > 0.99 * STRONGEST:
            return None
        value = max(strength / float(np.sqrt(one.information)), self._sized(one.term), self._confirmed(one))
        if value > min(self.problem.limits(p)[1] for p in one.term.effect.linear):
            return None
        name, unit, _ = self.problem.names(one.term)[0]
        at = {
            p.name: (x, p.unit_on(self.problem.unit))
            for p, x in zip(one.term.effect.shapes, one.term.shape, strict=True)
        }
        single = len(one.term.effect.linear) == 1
        return Detectable(name.partition("[")[0] if single else "amplitude", value, unit, at)

    def _shapes(self, hit: Hit) -> list[Term]:
        """Shapes of the hit's effect, evenly over those that would be told from settling at the start."""
        terms = hit.candidate.terms
        if len(terms) < 2:
            return [hit.term]
        if hit.candidate.effect.sudden:
            terms = tuple(t for t in terms if not self._settles(t))
            if not terms:  # of a short rest: wherever it jumps, its start would be left out
                return []
        return [terms[i] for i in np.unique(np.linspace(0, len(terms) - 1, SHAPES + 2).astype(int)[1:-1])]

    def _settles(self, term: Term) -> bool:
        """Whether the start of a run with such an effect would be left out as settling."""
        if settled_by(self.problem, term) is not None:
            return True
        block = self.problem.fitted[0]
        time, curve = (x[block.start : block.stop] for x in (self.problem.bins.time, self.problem.columns(term)[:, 0]))
        return len({b.run for b in self.problem.fitted}) == 1 and settling_curve(time, curve)

    def _strength(self, one: _Seen, need: float) -> float:
        """Whitened norm on the fitted data at which the effect is found."""
        if one.freedom < MANY:
            return _least(self._answer(one), need)
        ratio = float(np.sqrt(self._held_out(one.term, one.direction, self.fit) / one.information))
        return _strength(need, len(one.direction), one.freedom, ratio)

    def _sized(self, term: Term) -> float:
        """Amplitude that has a size in 95 % of recordings, shapes fitted beside it."""
        if not term.shape:
            return 0.0
        columns = design(self.problem, (*self.fit.model, term))
        beta, cov = coefficients(self.problem, columns, self.fit.noise.power)
        large = Fit((*self.fit.model, term), columns, beta, cov, self.fit.noise)
        _, cov = coefficients_of(self.problem, large, term)
        return float((LEAST + ndtri(POWER)) * np.sqrt(np.linalg.eigvalsh(cov)[-1])) if len(cov) else np.inf

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

    def _held_out(self, term: Term, direction: Floats, fit: Fit) -> float:
        """Information of the held-out data on a unit amplitude, with the noise of a ``fit``."""
        return held_out_information(self.problem, fit, self._remainder(term, direction, fit))

    def _remainder(self, term: Term, direction: Floats, fit: Fit) -> Floats:
        """What a unit amplitude leaves beside a ``fit`` without it, shape (bins,)."""
        problem, design = self.problem, fit.design
        weight = 1 / np.sqrt(spectrum(problem, fit.noise.power))
        new = problem.columns(term) @ direction
        if design.matrix.shape[1]:
            own = design.transformed * weight[:, None]
            moved = np.linalg.lstsq(own, weight * (problem.transformed(term) @ direction), rcond=None)[0]
            new = new - design.matrix @ (moved * (design.term >= 0))
        return new

    def _confirmed(self, one: _Seen) -> float:
        """Amplitude from which on the held-out data of this recording are no worse with the effect, of either sign.

        With their residual r and what a unit amplitude leaves in it, h, of which the noise of the fitted data shows e:
        |r - e h|^2 <= (1 + CHANCE)^2 |r +- A h|^2.
        """
        held = self.problem.bins.held_out
        r, h = residual(self.problem, self.fit)[held], self._remainder(one.term, one.direction, self.fit)[held]
        weight, q, left = whitened(self.problem, self.fit)
        column = weight * (self.problem.transformed(one.term) @ one.direction)
        shown = float(column @ left) / one.information
        after = float(np.sum((r - shown * h) ** 2)) / (1 + CHANCE) ** 2
        power, along = float(h @ h), abs(float(r @ h))
        root = along**2 - power * (float(r @ r) - after)
        return (along + float(np.sqrt(root))) / power if root > 0 and power > 0 else 0.0

    def _answer(self, one: _Seen) -> Callable[[float], _Answer]:
        """The answer of the search to an effect of a whitened norm, as data are to be expected."""
        problem, fit = self.problem, self.fit
        columns = problem.transformed(one.term)
        scale = np.sqrt(np.mean(columns**2, axis=0))
        shown = columns @ one.direction / np.sqrt(one.information)
        rows = np.column_stack([shown, fit.design.transformed, columns / scale])
        pooled = problem.grouping().pool(rows)
        own = 1 + fit.design.transformed.shape[1]
        prior = np.concatenate([fit.design.prior, (np.array(problem.priors(one.term)) * scale) ** -2.0])
        noise = pooled.count * (pooled.shapes @ fit.noise.power)

        def fitted(strength: float, size: int) -> NoiseFit:
            cross = pooled.cross[:, :size, :size].copy()
            cross[:, 0] *= strength
            cross[:, :, 0] *= strength
            cross[:, 0, 0] += noise
            given = Pooled(cross, pooled.count, pooled.shapes)
            return fit_noise(given, prior[: size - 1], restricted=False, start=fit.noise.power, most=problem.most)

        whole = fitted(0.0, len(pooled.cross[0])).loglik

        def answer(strength: float) -> _Answer:
            small = fitted(strength, own)
            power = np.maximum(small.power, fit.noise.power)
            _, cov = coefficients(problem, fit.design, power)
            swollen = replace(fit, cov=cov, noise=replace(fit.noise, power=power))
            weight, q, _ = whitened(problem, replace(fit, noise=small))
            fresh = weight * shown
            energy = (fresh - q @ (q.T @ fresh)) ** 2
            held = self._held_out(one.term, one.direction, swollen) / one.information
            d = len(one.direction)
            freedom = noise_freedom(problem, small.power, energy)
            return _Answer(d, max(2 * (whole - small.loglik), 0.0), freedom, float(np.sqrt(held)))

        return answer


@dataclass(frozen=True)
class _Answer:
    """What the search makes of an effect of ``d`` coefficients.

    Attributes
    ----------
    d : int
    ratio : float
        Likelihood ratio of the fitted data, beside what d coefficients gain by chance.
    freedom : float
        Of the noise that is fitted without the effect.
    held : float
        Whitened norm on the held-out data of an effect of which that on the fitted ones is 1.
    """

    d: int
    ratio: float
    freedom: float
    held: float


def _least(answer: Callable[[float], _Answer], need: float) -> float:
    """Whitened norm on the fitted data at which the joint deviate exceeds ``need`` with probability `POWER`."""
    told: list[_Answer] = []
    reached = 0.0
    for strength in _STRENGTHS:
        told.append(answer(strength))
        before, reached = reached, _joint(np.array(_STRENGTHS[: len(told)]), told, strength) - need
        if len(told) > 2 and reached > 0:
            break
    if reached <= 0:
        return STRONGEST
    low = _STRENGTHS[len(told) - 2]
    return float(low + (strength - low) * np.clip(before / (before - reached), 0, 1)) if before < 0 else low


def _joint(strengths: Floats, told: list[_Answer], at: float) -> float:
    """Joint deviate that an effect of the whitened norm ``at`` exceeds with probability `POWER`."""
    d = told[0].d
    ratio, freedom, held = (np.array([getattr(one, name) for one in told]) for name in ("ratio", "freedom", "held"))
    # By chance the fitted data hold a little more or less of it.
    shown = np.abs(at + _CHANCES)
    gained = np.interp(shown, strengths, ratio) + np.where(shown > at, (shown - at) * _slope(strengths, ratio), 0.0)
    nu = float(np.interp(at, strengths, freedom))
    growth = nu / d * np.expm1((gained + d - 1) / (nu + d + 1))
    fitted = -ndtri_exp(np.minimum(_log_tail(growth, d, nu), -1e-12))
    share = float(np.interp(at, strengths, held))
    z = (share * at + _CHANCES) / HELD_OUT_SPREAD
    tail = log_tails_of_t(np.abs(z), nu)
    normal = np.copysign(-ndtri_exp(np.minimum(np.where(np.isfinite(tail), tail, log_ndtr(-np.abs(z))), -1e-12)), z)
    rho = ((share * at) ** 2 / np.maximum(gained, 1e-3))[:, None]
    return _exceeded((fitted[:, None] + np.sqrt(rho) * normal) / np.sqrt(1 + rho))


def _exceeded(joint: Floats) -> float:
    """What joint deviates exceed with probability `POWER`, of all pairs of chances, shape (n, n)."""
    place = (joint.size - 1) * (1 - POWER)
    least, more = np.partition(joint.ravel(), (int(place), int(place) + 1))[int(place) : int(place) + 2]
    return float(least + place % 1 * (more - least))


def _slope(strengths: Floats, ratio: Floats) -> float:
    """Growth of the likelihood ratio with the strength at the last of these."""
    return float((ratio[-1] - ratio[-2]) / (strengths[-1] - strengths[-2])) if len(ratio) > 1 else 0.0


def _strength(need: float, d: int, freedom: float, ratio: float) -> float:
    """Whitened norm on the fitted data at which the joint deviate exceeds ``need`` with probability `POWER`.

    ``ratio`` is the whitened norm on the held-out data as a share of it.
    """
    freedom = max(freedom, LEAST_FREEDOM)
    grid, sizes = np.geomspace(1e-2, 4e3, 200), np.linspace(0, 60, 200)
    tail = log_tails_of_t(sizes, freedom)
    normal = -ndtri_exp(np.minimum(np.where(np.isfinite(tail), tail, log_ndtr(-sizes)), -1e-12))
    deviates = -ndtri_exp(np.minimum(_log_tail(freedom * np.log1p(grid / freedom) / d, d, freedom), -1e-12))

    def reached(strength: float) -> float:
        # The direction of the effect is normal; what the others of d coefficients gain by chance is taken at its mean.
        fitted = np.interp((strength + _CHANCES) ** 2 + d - 1, grid, deviates)
        # The smaller model's noise, with which the held-out data are weighed, has taken up some of the effect.
        z = (ratio * strength + _CHANCES) / HELD_OUT_SPREAD / np.sqrt(1 + strength**2 / freedom)
        held = np.copysign(np.interp(np.abs(z), sizes, normal), z)
        return _exceeded((fitted[:, None] + ratio * held) / np.sqrt(1 + ratio**2)) - need

    low, high = 0.5, STRONGEST
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if reached(middle) < 0 else (low, middle)
    return high


def _log_tail(ratio: Floats, d: int, freedom: float) -> Floats:
    """Logarithm of the tail of Fisher's F, by its normal limit where that cannot be computed."""
    log_tail = log_tails_of_f(ratio, d, freedom)
    return np.where(np.isfinite(log_tail), log_tail, log_ndtr(-np.sqrt(ratio * d)))
