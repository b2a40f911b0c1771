"""Which effects the rests call for: nested least squares, Fisher's F, and rests that no fit has seen.

    chi = [(RSS_0 - RSS_1) / d] / [RSS_1 / nu]  ~  F(d, nu)          without the effect's d parameters, and with them

The noise is the scatter from rest to rest, estimated from the residuals of the fit itself with its freedom nu: the
white noise of the samples knows nothing of a bias that wanders, of a bench that gives way. The held-out rests give a
second test without free parameters, and both are joined, as in `insenv.identify.fit.evidence`:

    z = r' V^-1 phi / sqrt(phi' V^-1 phi),    V = s^2 (I + J C J'),    phi = r_0 - r_1 on held-out rests

The probability is multiplied by the number of effects that were tried. An effect with which the error on held-out
rests grows is refused, however significant.

Where each unit is held out in its turn (`insenv.identify.positions.leave_out`), all are fitted: Fisher's F of all of
them is the whole evidence, and the error of the units that were left out may not grow either.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import comb
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.special import chdtrc, fdtrc, fdtri

from insenv.core.recording import Floats
from insenv.core.series.tails import log_tail_of_f, log_tail_of_t
from insenv.identify.findings import NotTestable, Rejected
from insenv.identify.fit.evidence import joint_deviate, log_tail
from insenv.identify.positions.leave_out import left_out

#: Most steps of a fit.
STEPS = 60
#: Relative gain that a step must promise.
ARRIVED = 1e-9
#: Smallest share of a step that is tried.
LEAST_SHARE = 1e-2
#: Share of its size that a column must have beside the model: below it the attitudes do not tell the effect.
DISTINCT = 0.02
#: Why an effect is refused that nothing confirms.
UNFORETOLD = "no rest foretells another"
#: Why a law is refused of which no instrument has so much.
INCREDIBLE = "larger than is credible"
#: Least freedom that an effect must leave.
LEAST_FREEDOM = 2
#: Most effects that are tried at once where none alone helps.
AT_ONCE = 3
#: Probability among instruments of a size below which an effect is no explanation of what a usual one explains.
UNUSUAL = 0.05
#: Probability, among all units, of one so far off by chance below which it is left out, and the largest share of them.
OUTLIER, MOST_OUTLIERS = 1e-4, 0.1
#: Probability of a scatter of held-out units below which their noise is taken to be larger.
SCATTERED = 0.01
#: Freedom of a variance that is known.
KNOWN = 10**6
#: Below this freedom the variance of Student's t says nothing any more.
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
    """A fit of ``terms``: parameters, residuals of all units and their derivatives, RSS and freedom of the fitted."""

    terms: tuple[Any, ...]
    theta: Floats
    residual: Floats
    slopes: Floats
    rss: float
    freedom: int
    inverse: Floats

    @property
    def variance(self) -> float:
        """Of one component, from the scatter of the fitted units."""
        return self.rss / max(self.freedom, 1)

    def sd(self) -> Floats:
        """Standard deviations, shape (p,): wider where the scatter is known with little freedom (Student's t)."""
        nu = max(self.freedom, LEAST_T)
        return np.sqrt(np.diag(self.inverse) * self.variance * nu / (nu - 2))

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
        rows, right = _normal(problem, residual, slopes, theta, scale)
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
    rows, _ = _normal(problem, residual, slopes, theta, scale)
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
    size[size == 0] = 1.0
    return size


def _scale(problem: Problem, residual: Floats, p: int) -> float:
    freedom = max(problem.rank * int(problem.fitted.sum()) - p, 1)
    return float(np.sum(residual[problem.fitted] ** 2)) / freedom


def _normal(problem: Problem, residual: Floats, slopes: Floats, theta: Floats, scale: float) -> tuple[Floats, Floats]:
    """Rows of the linearised problem and their right side: the fitted units, then the priors."""
    fitted = problem.fitted
    p, n = len(theta) - len(problem.nuisance), len(theta)
    rows = slopes[fitted].reshape(residual[fitted].size, n)
    prior = np.sqrt(scale) * np.eye(n)[p:] / problem.nuisance[:, None]
    return np.vstack([rows, prior]), np.concatenate([residual[fitted].ravel(), prior @ theta])


def held_out_errors(problem: Problem, *fits: Fit, units: NDArray[np.bool_] | None = None) -> tuple[float, ...]:
    """Of each fit, the root mean square of the lengths of the residuals of the held-out units, or of some ``units``.

    Where each is held out in its turn, of those that every one of the fits foretells without it.
    """
    if in_turn(problem):
        each = [left_out(problem.root, fit.residual, fit.slopes, fit.inverse, problem.fitted) for fit in fits]
        known = problem.fitted & np.all([np.isfinite(left).all(axis=1) for left in each], axis=0)
    else:
        each, known = [problem.plain(fit.residual) for fit in fits], problem.held_out if units is None else units
    return tuple(float(np.sqrt(np.mean(np.sum(left[known] ** 2, axis=1)))) if known.any() else np.nan for left in each)


def held_out_error(problem: Problem, fit: Fit) -> float:
    """`held_out_errors` of one fit."""
    return held_out_errors(problem, fit)[0]


def noise_floor(problem: Problem, fit: Fit) -> float:
    """What `held_out_error` would be if the fitted noise alone were left, that of the coefficients included."""
    m, d = fit.residual.shape
    slopes = fit.slopes.reshape(m * d, -1)
    fitted = np.repeat(problem.fitted, d)
    # Whitened residuals are (1 - J C J_f') times unit normals.
    spread = np.eye(m * d)
    spread[:, fitted] -= slopes @ fit.told @ slopes[fitted].T
    if in_turn(problem):
        each = left_out(problem.root, spread.reshape(m, d, -1), fit.slopes, fit.inverse, problem.fitted)
        known = problem.fitted & np.isfinite(each).all(axis=(1, 2))
        return float(np.sqrt(fit.variance * np.sum(each[known] ** 2) / max(int(known.sum()), 1)))
    power = np.sum(problem.plain(spread.reshape(m, d, -1))[problem.held_out] ** 2)
    return float(np.sqrt(fit.variance * power / max(int(problem.held_out.sum()), 1)))


@dataclass(frozen=True)
class Evidence:
    """How much a larger fit explains: deviate of fitted and held-out units joined, likelihood ratio of the fitted."""

    deviate: float
    likelihood_ratio: float

    def p_value(self, looks: float) -> float:
        """Probability of such evidence anywhere in so many looks."""
        return float(min(1.0, looks * np.exp(log_tail(self.deviate))))


def evidence(problem: Problem, small: Fit, large: Fit, variance: float | None = None) -> Evidence:
    """Of the fit ``large``, which has all the terms of ``small``; ``variance`` of the noise, by ``large`` if None."""
    gained, nu = small.freedom - large.freedom, large.freedom if variance is None else KNOWN
    noise = large.variance if variance is None else variance
    if noise <= 0 or nu < 1:
        return Evidence(-np.inf, 0.0)
    change = max(small.rss - large.rss, 0.0)
    # What all units have in common shows in no scatter: held-out units are judged with a spread for it, or else these.
    common = problem.spread**2 if in_turn(problem) else 1.0
    log_p = log_tail_of_f(change / gained / noise / common, gained, nu)
    ratio = float(problem.rank * problem.fitted.sum() * np.log(max(small.rss / large.rss, 1.0)))
    z, information = (0.0, 0.0) if in_turn(problem) else _held_out_deviate(problem, small, large, noise)
    return Evidence(joint_deviate(log_p, change / noise, z, information), ratio)


def _held_out_deviate(problem: Problem, small: Fit, large: Fit, noise: float) -> tuple[float, float]:
    """The normal deviate of the held-out units, and its information.

    A few units that neither fit explains, knocks and polluted readings, point somewhere all the same, and are left
    out. Where more of them scatter than the fit foretells, they are judged with the least noise that makes it credible.
    """
    held = _explained(problem, small, large, noise)
    ratio, count = held_out_scatter(problem, large, held, noise)
    noise *= max(1.0, ratio / float(fdtri(count, max(large.freedom, 1), 1 - SCATTERED)))
    r = small.residual[held].ravel()
    phi = r - large.residual[held].ravel()
    whitened = _Foretold.of(small, held).whiten(phi) / noise
    information = float(phi @ whitened)
    if not information > 1e-12:
        return 0.0, 0.0
    z = float(r @ whitened) / np.sqrt(information) / problem.spread
    log_p = log_tail_of_t(abs(z), large.freedom)
    return float(np.copysign(-_ndtri_exp(log_p), z)), information


def _explained(problem: Problem, small: Fit, large: Fit, noise: float) -> NDArray[np.bool_]:
    """Held-out units, shape (m,), without those that are alone in that neither fit explains them (F, Bonferroni)."""
    held = problem.held_out
    if in_turn(problem) or not held.any() or not noise > 0:
        return held
    sizes = [
        np.sum((fit.residual[held].ravel() ** 2 / _Foretold.of(fit, held).variances).reshape(held.sum(), -1), axis=1)
        for fit in (small, large)
    ]
    tails = fdtrc(problem.rank, max(large.freedom, 1), np.minimum(*sizes) / problem.rank / noise)
    odd = tails * held.sum() < OUTLIER
    if odd.sum() > MOST_OUTLIERS * held.sum():
        return held
    explained = held.copy()
    explained[held] = ~odd
    return explained


def held_out_scatter(problem: Problem, fit: Fit, units: NDArray[np.bool_], variance: float) -> tuple[float, int]:
    """Mean square of what held-out units are off by, in what the fit and a noise of ``variance`` foretell; of how many.

    ~ F(count, freedom of the variance) if the fit is all there is.
    """
    r = fit.residual[units].ravel()
    count = max(problem.rank * int(units.sum()), 1)
    return float(r @ _Foretold.of(fit, units).whiten(r)) / count / variance, count


@dataclass(frozen=True)
class _Foretold:
    """Covariance V = I + J C J' of what a fit foretells of units, by ``half`` = J C^(1/2), shape (n, p)."""

    half: Floats

    @classmethod
    def of(cls, fit: Fit, units: NDArray[np.bool_]) -> _Foretold:
        slopes = fit.slopes[units]
        size = np.sqrt(np.maximum(np.diag(fit.told), 1e-300))
        powers, vectors = np.linalg.eigh(fit.told / np.outer(size, size))
        flat = slopes.reshape(slopes.shape[0] * slopes.shape[1], len(size))
        return cls((flat * size) @ (vectors * np.sqrt(np.maximum(powers, 0.0))))

    @property
    def variances(self) -> Floats:
        """The diagonal of V, shape (n,)."""
        return np.asarray(1 + np.sum(self.half**2, axis=1), float)

    def whiten(self, values: Floats) -> Floats:
        """V^-1 ``values`` by the matrix inversion lemma, shape (n,)."""
        inner = np.eye(self.half.shape[1]) + self.half.T @ self.half
        return np.asarray(values - self.half @ np.linalg.solve(inner, self.half.T @ values), float)


def _ndtri_exp(log_p: float) -> float:
    from scipy.special import ndtri_exp

    return float(ndtri_exp(min(log_p, -1e-12)))


@dataclass(frozen=True)
class Step:
    """An effect that was added; ``together`` with others where none of them alone was."""

    term: Any
    p_value: float
    likelihood_ratio: float
    before: float
    after: float
    together: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """End of a search: fits before and after, what was added, refused, cannot be tested, and rivals of the added."""

    before: Fit
    after: Fit
    steps: tuple[Step, ...] = ()
    rejected: tuple[Rejected, ...] = ()
    not_testable: tuple[NotTestable, ...] = ()
    rivals: dict[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Doubt:
    """What else may be true that this recording cannot tell: ``problem`` with its noise, effects ``beside`` the model.

    What is only significant without it is not added; ``reason`` ends the sentence "not significant ...". Where
    attitudes follow the clock, a drift is whatever follows the attitude. ``variance`` is the noise where it is known,
    no matter what a fit leaves.
    """

    problem: Problem
    beside: tuple[Any, ...]
    reason: str
    variance: float | None = None


def search(  # noqa: PLR0913 -- of three callers each names what it has
    problem: Problem,
    declared: Sequence[Any],
    tried: Sequence[Any],
    alpha: float,
    doubts: Sequence[Doubt] = (),
    untold: Sequence[Any] = (),
    told: Callable[[Sequence[Any]], bool] = lambda terms: True,
    at_once: int = AT_ONCE,
) -> Outcome:
    """Add to the declared model, one after the other, what fitted and held-out units call for, whatever the doubts.

    ``untold`` are effects that these units cannot tell from noise: they are not added, and are rivals all the same.
    ``told`` says of terms beside the declared ones whether these units tell them all together. Terms of one key are
    forms of one effect. ``at_once`` are the most that are tried together where none alone helps.
    """
    before = solve(problem, declared)
    testable, blind = _testable(problem, before, tried)
    looks = max(len(testable), 1)
    now, steps = before, list[Step]()
    refused: dict[str, Rejected] = {}
    alone: dict[str, Rejected] = {}
    while True:
        left = [term for term in testable if term not in now.terms]
        added = [step.term for step in steps]
        sets = [terms for terms in _sets(left, at_once) if told([*added, *terms])]
        found = _round(problem, now, sets, looks, alpha, refused, doubts)
        alone = alone or dict(refused)
        if not found:
            break
        now, new = found
        steps += new
        now, steps = _pruned(problem, declared, now, steps, looks, alpha, refused)
        if len(steps) > 3 * len(testable):  # added and dropped in turn: enough
            break
    while steps and not _no_worse(problem, before, now):
        last = steps.pop()
        key = last.term.effect.key
        reason = "with it the held-out error is larger than that of the declared model"
        refused[key] = Rejected(key, last.p_value, last.likelihood_ratio, reason)
        now = solve(problem, [term for term in now.terms if term is not last.term])
    rivals = {s.term.effect.key: _rivals(problem, now, s.term, [*testable, *untold], looks, alpha, told) for s in steps}
    for key in refused.keys() & {step.term.effect.key for step in steps}:
        del refused[key]
    refused |= {key: r for step in steps if (r := _alone(alone.get(key := step.term.effect.key)))}
    rejected = tuple(sorted(map(_plain, refused.values()), key=lambda r: r.p_value))
    return Outcome(before, now, tuple(steps), rejected, blind, rivals)


def _no_worse(problem: Problem, before: Fit, now: Fit) -> bool:
    """Whether what was added, and has outlived the rest, leaves no larger held-out error than the declared model."""
    errors = held_out_errors(problem, before, now, units=_explained(problem, before, now, now.variance))
    return bool(errors[1] <= errors[0])


def _testable(problem: Problem, before: Fit, tried: Sequence[Any]) -> tuple[list[Any], tuple[NotTestable, ...]]:
    """Terms that these units can tell, and the others with what they would need."""
    testable, blind = [], []
    units = int(problem.fitted.sum())
    for term in tried:
        if before.freedom - term.size < LEAST_FREEDOM:
            lacking = LEAST_FREEDOM - (before.freedom - term.size)
            more = -(-lacking // problem.rank)
            reason = f"{units} fitted for too many parameters; at least {more} more needed"
            blind.append(NotTestable(term.effect.key, ("more positions",), reason))
        elif distinct(problem, before, term) < DISTINCT:
            reason = "in these attitudes it cannot be told from the declared model"
            blind.append(NotTestable(term.effect.key, ("other attitudes",), reason))
        else:
            testable.append(term)
    return testable, tuple(blind)


def as_told(problem: Problem, declared: Sequence[Any], tried: Sequence[Any]) -> list[Any]:
    """What may be found, each with the coefficients that these units tell beside what is declared.

    An axis of a table that rests shows no eccentricity, an accelerometer that points up alone no scale factor. What
    has no coefficient that is told stays whole, and is said not to be testable.
    """
    before, found = solve(problem, declared), []
    for term in tried:
        whole = before.freedom - term.size < LEAST_FREEDOM or distinct(problem, before, term) >= DISTINCT
        kept = [] if whole else distinct_part(problem, before, term)
        found.append(term.part(kept) if kept else term)
    return found


def distinct(problem: Problem, fit: Fit, term: Any) -> float:
    """The least share of a unit change of ``term`` that the model of ``fit`` leaves; below `DISTINCT` it is blind."""
    return _least_share(*_left(problem, fit, term))


def distinct_part(problem: Problem, fit: Fit, term: Any) -> list[int]:
    """Places of the coefficients of ``term`` that are told beside the model of ``fit``, and together."""
    left, size = _left(problem, fit, term)
    _, upper, order = qr(left, mode="economic", pivoting=True)
    kept = [int(j) for j, share in zip(order, np.abs(np.diag(upper)), strict=True) if share >= DISTINCT]
    while kept and _least_share(left[:, kept], size[kept]) < DISTINCT:
        kept.remove(min(kept, key=lambda j: float(size[j])))  # hardly any change at all
    return sorted(kept)


def _least_share(left: Floats, size: Floats) -> float:
    return float(np.linalg.svd(left * (size / max(size.max(), 1e-300)), compute_uv=False)[-1])


def _left(problem: Problem, fit: Fit, term: Any) -> tuple[Floats, Floats]:
    """What the model of ``fit`` leaves of each coefficient's change, as a share of it, and the change's size."""
    p = sum(t.size for t in fit.terms)
    theta = np.concatenate([fit.theta[:p], np.zeros(term.size), fit.theta[p:]])
    residual, slopes = problem.evaluate((*fit.terms, term), theta)
    slopes, _ = _normal(problem, residual, slopes, theta, fit.variance)
    own = slopes[:, p : p + term.size]
    model = np.delete(slopes, np.s_[p : p + term.size], axis=1)
    size = np.linalg.norm(own, axis=0)
    shares = own / np.where(size > 0, size, 1.0)
    if model.shape[1]:
        scaled = model / np.maximum(np.linalg.norm(model, axis=0), 1e-300)
        shares = shares - scaled @ np.linalg.lstsq(scaled, shares, rcond=1e-8)[0]
    return shares, size


def _round(
    problem: Problem,
    now: Fit,
    sets: Sequence[tuple[Any, ...]],
    looks: int,
    alpha: float,
    refused: dict[str, Rejected],
    doubts: Sequence[Doubt] = (),
) -> tuple[Fit, list[Step]] | None:
    """The best single effect; where none is accepted, the best of several at once; None where nothing is.

    One of a size that instruments hardly have comes after all that have a usual one.
    """
    best: tuple[tuple[bool, float], Fit, tuple[Any, ...], Evidence, float] | None = None
    # Sets of k share the probability of looks^k, and all sizes that of one: Bonferroni.
    chances = sum(comb(looks, k) / looks**k for k in range(1, AT_ONCE + 1))
    for terms in sets:
        if best and len(terms) > len(best[2]):
            break  # one alone does it
        count = chances * looks ** len(terms)
        fit = solve(problem, (*now.terms, *terms))
        if fit.freedom < LEAST_FREEDOM:
            continue
        found = evidence(problem, now, fit)
        p = found.p_value(count)
        reason = _refusal(problem, now, fit, terms, p, alpha)
        if not reason and (other := _doubted(now, terms, doubts, count, alpha)):
            p, reason = other
        if reason and len(terms) == 1:
            key = terms[0].effect.key
            refused[key] = Rejected(key, p, found.likelihood_ratio, reason)
        rank = not any(_unusual(fit, term) for term in terms), found.deviate
        if not reason and (best is None or rank > best[0]):
            best = rank, fit, terms, found, p
    if best is None:
        return None
    _, fit, terms, found, p = best
    without, with_it = held_out_errors(problem, now, fit)
    keys = [term.effect.key for term in terms]
    together = tuple(keys) if len(keys) > 1 else ()
    return fit, [Step(term, p, found.likelihood_ratio, without, with_it, together) for term in terms]


def _alone(refused: Rejected | None) -> Rejected | None:
    """An added effect that by itself made held-out units worse: it is the others that make the difference."""
    if refused is None or "held-out" not in refused.reason:
        return None
    return replace(refused, reason=f"alone: {refused.reason}")


def _plain(refused: Rejected) -> Rejected:
    """Of what is not significant the held-out error does not matter."""
    insignificant = refused.reason.startswith("not significant,")
    return replace(refused, reason="not significant") if insignificant else refused


def _sets(left: Sequence[Any], at_once: int) -> Iterator[tuple[Any, ...]]:
    for count in range(1, min(at_once, len(left)) + 1):
        yield from combinations(left, count)


def _refusal(problem: Problem, now: Fit, fit: Fit, terms: tuple[Any, ...], p: float, alpha: float) -> str:
    """Why the effects are not added; empty if they are."""
    errors = held_out_errors(problem, now, fit, units=_explained(problem, now, fit, fit.variance))
    if not np.isfinite(errors).all():
        return UNFORETOLD
    worse = f"held-out error {errors[1] / errors[0]:.3g} times as large" if errors[1] > errors[0] else ""
    if not p < alpha:
        return f"not significant, {worse}" if worse else "not significant"
    if worse:
        return worse
    if any(_beyond(problem, fit, term) for term in terms):
        return INCREDIBLE
    return ""


def _doubted(
    now: Fit, terms: tuple[Any, ...], doubts: Sequence[Doubt], count: float, alpha: float
) -> tuple[float, str] | None:
    """P-value under the first doubt under which the effects are not significant, and the reason to refuse them."""
    for doubt in doubts:
        small, large = (solve(doubt.problem, (*now.terms, *doubt.beside, *more)) for more in ((), terms))
        p = evidence(doubt.problem, small, large, doubt.variance).p_value(count)
        if not p < alpha:
            return p, f"not significant {doubt.reason}"
    return None


def _beyond(problem: Problem, fit: Fit, term: Any) -> bool:
    """Whether coefficients are larger than is credible, beside a factor of all readings that is certain."""
    bound = max(param.bound for param in term.effect.linear) + abs(getattr(problem, "gain", 1.0) - 1)
    return bool(np.any(np.abs(fit.theta[fit.of(term)]) > bound))


def _pruned(
    problem: Problem,
    declared: Sequence[Any],
    now: Fit,
    steps: list[Step],
    looks: int,
    alpha: float,
    refused: dict[str, Rejected],
) -> tuple[Fit, list[Step]]:
    """Without what has become superfluous beside what was added later."""
    while len(steps) > 1:
        tested = []
        for step in steps:
            small = solve(problem, [t for t in now.terms if t is not step.term])
            found = evidence(problem, small, now)
            tested.append((found.p_value(looks), found.likelihood_ratio, step, small))
        p, ratio, step, small = max(tested, key=lambda row: row[0])
        if p < alpha:
            break
        now, steps = small, [s for s in steps if s is not step]
        key = step.term.effect.key
        refused[key] = Rejected(key, p, ratio, "superfluous beside what was added")
    return now, steps


def _rivals(
    problem: Problem,
    now: Fit,
    term: Any,
    testable: Sequence[Any],
    looks: int,
    alpha: float,
    told: Callable[[Sequence[Any]], bool],
) -> tuple[str, ...]:
    """Effects with which in its place the added one is no longer significant, or no longer told."""
    others = [t for t in now.terms if t is not term]
    base = solve(problem, others)
    found: list[str] = []
    for rival in testable:
        if rival in now.terms or rival.effect.key in {term.effect.key, *found}:
            continue
        without = solve(problem, [*others, rival])
        both = solve(problem, [*others, rival, term])
        if evidence(problem, base, without).p_value(looks) >= alpha:
            continue
        if _unusual(without, rival):
            continue
        blind = both.freedom < 1 or not told([term, rival])
        if blind or evidence(problem, without, both).p_value(looks) >= alpha:
            found.append(rival.effect.key)
    return tuple(found)


def _unusual(fit: Fit, term: Any) -> bool:
    """Whether the coefficients are, for certain, of a size that instruments hardly have (chi-square)."""
    usual = max(param.sd for param in term.effect.linear)
    values, sd = fit.theta[fit.of(term)], fit.sd()[fit.of(term)]
    return bool(chdtrc(term.size, float(np.sum(values**2 / (usual**2 + sd**2)))) < UNUSUAL)
