"""Which effects the rests call for: nested least squares, Fisher's F, and rests that no fit has seen.

What a unit is, and how terms are fitted to them, is in `insenv.identify.positions.least_squares`; how sure an effect is
in `insenv.identify.positions.evidence`. The probability is multiplied by the number of effects that were tried. An
effect with which the error on held-out rests grows is refused, however significant; but where errors of a table of
which a deviation is stated follow it nearly as well, and pay for that in their deviations, so they do in held-out
rests, which speak against it only by a deviate of less than -`insenv.identify.positions.evidence.AGAINST`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr
from scipy.special import chdtrc

from insenv.core.recording import Floats
from insenv.identify.findings import NotTestable, Rejected
from insenv.identify.positions.evidence import Evidence, evidence, explained, followed, held_out_errors
from insenv.identify.positions.least_squares import Fit, Problem, normal, solve

#: Share of its size that a column must have beside the model: below it the attitudes do not tell the effect.
DISTINCT = 0.02
#: Of two columns that are one, but for rounding: what their correlation is less than one by at most.
ONE_CURVE = 1e-9
#: Why an effect is refused that nothing confirms.
UNFORETOLD = "no rest foretells another"
#: Why a law is refused of which no instrument has so much.
INCREDIBLE = "larger than is credible"
#: Least freedom that an effect must leave.
LEAST_FREEDOM = 2
#: Most effects that are tried at once where none alone helps.
AT_ONCE = 3
#: Scatter that an effect leaves, in that of what was added in its place, beyond which it explains too little.
WORSE = 3.0
#: Probability among instruments of a size below which an effect is no explanation of what a usual one explains.
UNUSUAL = 0.05


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
    looks = max(sum(getattr(term, "looks", 1) for term in testable), 1)
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
    beside = [step.term for step in steps]
    for term in testable if steps else ():
        if term not in now.terms and term.effect.key in refused and not told([*beside, term]):
            del refused[term.effect.key]  # it was asked before what is there now
            blind += (NotTestable(term.effect.key, ("more positions",), "too few to tell it beside what was added"),)
    rivals = {s.term.effect.key: _rivals(problem, now, s.term, [*testable, *untold], looks, alpha, told) for s in steps}
    for key in refused.keys() & {step.term.effect.key for step in steps}:
        del refused[key]
    refused |= {key: r for step in steps if (r := _alone(alone.get(key := step.term.effect.key)))}
    rejected = tuple(sorted(map(_plain, refused.values()), key=lambda r: r.p_value))
    return Outcome(before, now, tuple(steps), rejected, blind, rivals)


def _no_worse(problem: Problem, before: Fit, now: Fit) -> bool:
    """Whether what was added, and has outlived the rest, leaves no larger held-out error than the declared model."""
    errors = held_out_errors(problem, before, now, units=explained(problem, before, now, now.variance))
    return bool(errors[1] <= errors[0]) or followed(problem, before, now)


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
    slopes, _ = normal(problem, residual, slopes, theta, fit.variance)
    own = slopes[:, p : p + term.size]
    # What is stated of the very error that the term is tells nothing against it: it is far beyond that, or it is none.
    stated = _alike(slopes[: len(slopes) - len(problem.nuisance)], np.arange(p, p + term.size), p + term.size)
    model = np.delete(slopes, [*range(p, p + term.size), *stated], axis=1)
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
    errors = held_out_errors(problem, now, fit, units=explained(problem, now, fit, fit.variance))
    if not np.isfinite(errors).all():
        return UNFORETOLD
    grows = errors[1] > errors[0] and not followed(problem, now, fit)
    times = f"{errors[1] / errors[0]:.3g} times as large" if errors[0] else "where there was none"
    worse = f"held-out error {times}" if grows else ""
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
        if _unusual(without, rival) or without.variance > WORSE**2 * now.variance:
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


def _alike(rows: Floats, own: NDArray[np.int64], first: int) -> list[int]:
    """Columns of ``rows`` from the ``first`` on that are one of its ``own`` columns, but for a factor."""
    unit = rows / np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    return [j for j in range(first, rows.shape[1]) if np.any(np.abs(unit[:, own].T @ unit[:, j]) > 1 - ONE_CURVE)]
