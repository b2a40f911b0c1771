"""A formula for what has no name: products of what was recorded, tried where no effect of the catalogue explains it.

Every product of one or two factors (`insenv.effects.formula`) that no effect of the catalogue is, and the first-order
lag of the plain ones, is a candidate of one more round of the search, on the model without curves that have no cause:
beside the effects that were added, and in their place. The test is the engine's own (`insenv.identify.search.round`):
likelihood ratio with the noise fitted anew, F, joined with the held-out data. Looks are counted: independent shapes of
a candidate, times all formulas and all candidates of the search before.

A formula is told where it is significant by all that, makes the held-out error smaller, is confirmed by the held-out
data alone (`CONFIRMED`), has a size, and leaves nothing behind that a curve without a cause would explain: a product
that is a part of a law is not the law. Of formulas that explain as well (`AS_WELL`) the plainest is told, and those
that are less likely by less than `TOLD` are named beside it. In the place of effects it is told where it explains more
than they do, with the looks and parameters of both paid for, and none of them is significant beside it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from itertools import combinations

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.acceleration import VibrationRectification
from insenv.effects.angle import AngleLockedRate
from insenv.effects.base import Effect, Instrument
from insenv.effects.cross import GSensitivity
from insenv.effects.formula import FACTORS, FREE, STANDS, Product, made, name_of, product
from insenv.effects.rate.lag import SLOWEST
from insenv.effects.spline import SplineRate, SplineTemperature, SplineTime
from insenv.identify.findings import Formulas, FoundFormula
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import confirms, held_out_score, rescored
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.loop import Outcome
from insenv.identify.search.candidates import Candidate, candidates
from insenv.identify.search.round import at_shape, search, with_term
from insenv.identify.search.scan import Hit, Reference, Scores, likelihood_ratio, reference, score_alone
from insenv.identify.search.settle import dropped
from insenv.identify.search.size import unsized
from insenv.identify.search.tracks import Progress, Step, Track

#: Candidates, best score first, whose likelihood ratios are taken: looks count all.
MOST_REFITTED = 40
#: Significant formulas that are put to the tests of held-out data, best first.
MOST_JUDGED = 8
#: Normal deviate by which held-out data alone must confirm a formula: one of twenty by chance.
CONFIRMED = 1.645
#: Twice the logarithm of the likelihood, less two for each parameter, by which a formula may be behind the likeliest
#: one and is as good, so that the plainer one is told: odds of 7; and by which one that is behind is told from it: 20.
AS_WELL, TOLD = 4.0, 6.0
#: Share of the largest rate that the least one must have where one over the rate is tried.
LEAST_RATE = 0.02

#: Probability, all that was tried paid for, from which on a product that nobody asked for is a doubt.
CERTAIN = 1e-3
#: Normal deviate by which held-out data must support such a doubt, whose probability has their evidence in it already.
SUPPORTED = 1.0
#: Candidates whose likelihood ratios are taken there, and the least score that has any: a third of the likelihood ratio
#: where the noise was fitted, which took in what has no name.
FEW_REFITTED, SEEN = 8, 10.0

#: What effects of the catalogue are, or become: one factor, and two.
CATALOGUED = {
    *("u", "|u|", "u^2", "u^3", "du/dt", "(T - T_ref)", "(T - T_ref)^2", "(T - T_ref)^3", "dT/dt", "t"),
    *("cos(a + p)", "cos(2 a + p)", "cos(3 a + p)", "cos(4 a + p)"),
    *("f_x", "f_y", "f_z", "v_x", "v_y", "v_z"),
    *("u * (T - T_ref)", "u * t"),
    *(f"u * cos({n}a + p)" for n in ("", "2 ", "3 ", "4 ")),
    *("lag(|u|)", "lag(u^2)", "lag(du/dt)", "lag((T - T_ref))", "lag(t)", "lag(t^2)"),
}
#: Columns of a formula at most.
MOST_COLUMNS = 4
#: What follows the rate by a lag, which an output's filter does where it is fast.
AFTER_EFFECT = "lag(u)"
#: Of these alone no formula is made: any slow noise follows the time.
_TIME_ALONE = ("t", "t^2")


@cache
def grammar() -> tuple[Product, ...]:
    """All formulas that are tried, plainest first."""
    single = [product(text) for text in FACTORS]
    several = [(a, b) for a, b in combinations(FACTORS.values(), 2) if a.driver != b.driver and not (a.free and b.free)]
    pairs = [Product(both) for both in several if len(both[0].parts) * len(both[1].parts) <= MOST_COLUMNS]
    plain = [p for p in (*single, *pairs) if _plain(p)]
    found = (*single, *pairs, *(Product(p.factors, lagged=True) for p in plain))
    kept = [p for p in found if _usual(p.text) not in CATALOGUED and _usual(p.text) not in _TIME_ALONE]
    return tuple(sorted(kept, key=lambda p: p.simplicity))


@cache
def unasked() -> tuple[Product, ...]:
    """Those of them that are tried in any case: lags, each of several times, are two thirds of the work.

    Of these only the rate's own, far slower than an output's filter: an after-effect of the rates before.
    """
    return tuple(formula for formula in grammar() if not formula.lagged or formula.text == AFTER_EFFECT)


def _usual(text: str) -> str:
    """A formula with the origins of the recording in the place of those of its own."""
    for own, usual in FREE.items():
        text = text.replace(own, usual)
    return text


def _plain(formula: Product) -> bool:
    """Whether its first-order lag is tried: of one factor, and of two that are plain; without angle and time."""
    if any(f.driver in ("a", "t") or f.free for f in formula.factors):
        return False
    return len(formula.factors) == 1 or all(f.simplicity <= 2 for f in formula.factors)


def formulas_of(outcome: Outcome, progress: Progress = lambda text: None) -> dict[str, Formulas]:
    """What a search among formulas comes to on each target."""
    return {t.problem.target: sought(t, outcome.alpha, outcome.seed, progress) for t in outcome.tracks}


def with_laws(outcome: Outcome, progress: Progress = lambda text: None) -> Outcome:
    """The outcome with the product that what is left follows, on each target that turns or is heated: a doubt.

    What had been added, explains less than a product in its place and is nothing beside it, has no name any more.
    """
    tracks = tuple(_with_law(t, outcome.alpha, outcome.seed, progress) for t in outcome.tracks)
    return replace(outcome, tracks=tracks)


def _heats(problem: Problem) -> bool:
    """Whether the temperature of each run was recorded, and changed in one."""
    read = [e.motion.temperature for e in problem.exposures]
    return all(t is not None for t in read) and any(np.ptp(t) > 0 for t in read if t is not None)


def _with_law(track: Track, alpha: float, seed: int, progress: Progress) -> Track:
    problem = track.problem
    if not problem.turns and not _heats(problem):
        return track
    tried = testable(problem, _refitted(track, track.fit.named), unasked())
    search_on = partial(_seen, track, tried=tried, seed=seed)
    for step in track.steps:
        if not _may_be_a_part(step):
            continue
        others = tuple(term for term in track.fit.named if term is not step.hit.term)
        fit = _refitted(track, others)
        found, hits, _ = search_on(fit)
        base = reference(problem, fit.model, fit.noise.power)
        own = at_shape(problem, fit, base, step.hit, step.hit.term)
        if found is not None and explains_more(found, own) and not _holds(problem, base, found.term, step.hit.term):
            progress(f"{problem.target}: a product explains more than {step.hit.candidate.effect.key}")
            return _in_its_place(track, step, _found(problem, fit, found, hits), found, alpha)
    fit = _refitted(track, track.fit.named)
    found, hits, _ = search_on(fit)
    return track if found is None else replace(track, law=_found(problem, fit, found, hits))


def explains_more(product: Hit, own: Hit) -> bool:
    """Whether a product explains more than an effect, beside errors of the reference and by itself as well.

    Of an encoder's wave these errors take most and of a product like it less, though it explains no more of the data.
    """
    by_itself = product.likelihood_ratio - product.spent - (own.likelihood_ratio - own.spent)
    return min(product.rank - own.rank, by_itself) >= TOLD


def _holds(problem: Problem, base: Reference, law: Term, part: Term) -> bool:
    """Whether a law with an origin of its own holds an effect: beside that the part that changes is a law by itself."""
    gained = [likelihood_ratio(problem, base, (*base.model, law, *more))[1] for more in ((), (part,))]
    return gained[0] == gained[1]


def _may_be_a_part(step: Step) -> bool:
    """Whether what a step added may stand for a product: no response and no gain, and no joint cause."""
    effect = step.hit.candidate.effect
    return not (effect.generic or effect.of_response or effect.part == "gain" or step.together)


def _in_its_place(track: Track, step: Step, law: FoundFormula, found: Hit, alpha: float) -> Track:
    """The track with a law in the place of a step, and without what is nothing beside it."""
    problem, behind = track.problem, [step]
    model = with_term(tuple(t for t in track.fit.named if t is not step.hit.term), found.term)
    for other in track.steps:
        if other is step or not (_may_be_a_part(other) or other.hit.candidate.generic):
            continue
        rest = tuple(t for t in model if t is not other.hit.term)
        fit = solve(problem, rest, start=track.fit.noise.power)
        base = reference(problem, fit.model, fit.noise.power)
        if at_shape(problem, fit, base, other.hit, other.hit.term).log_p >= math.log(alpha):
            behind.append(other)
            model = rest
    keys = tuple(s.hit.candidate.effect.key for s in behind if not s.hit.candidate.generic)
    for gone in behind:
        track = dropped(track, gone, "")
    return replace(track, law=law, behind=keys)


def sought(track: Track, alpha: float, seed: int, progress: Progress = lambda text: None) -> Formulas:
    """What a search among formulas comes to on a target: beside the effects that were added, or in their place."""
    problem = track.problem
    named = track.fit.named
    fit = _refitted(track, named)
    tried = testable(problem, fit, grammar())
    if not tried:
        return Formulas(0, None, "nothing was recorded of which products could be told")
    progress(f"{problem.target}: trying {len(tried)} formulas")
    search_on = partial(_searched, track, tried=tried, alpha=alpha, seed=seed)
    found, hits, reason = search_on(fit)
    if len(named) > len(track.prepared.model):
        instead = _instead(track, search_on, found, alpha)
        if instead is not None:
            return Formulas(len(tried), instead)
    if found is None:
        return Formulas(len(tried), None, reason)
    return Formulas(len(tried), _found(problem, fit, found, hits))


def _refitted(track: Track, model: Model) -> Fit:
    if len(model) == len(track.fit.model):
        return track.fit
    return solve(track.problem, model, start=track.fit.noise.power)


def _searched(
    track: Track, fit: Fit, tried: tuple[Candidate, ...], alpha: float, seed: int
) -> tuple[Hit | None, list[Hit], str]:
    """The formula that is told beside a model, all that are significant, and else why none is told."""
    best = _likeliest(score_alone(track.problem, fit, tried), tried)
    return _judged(track, fit, best, len(tried), alpha, seed)


def _seen(track: Track, fit: Fit, tried: tuple[Candidate, ...], seed: int) -> tuple[Hit | None, list[Hit], str]:
    """The same of the largest scores alone, and of none where none is large: where nobody asked for a formula."""
    scores = score_alone(track.problem, fit, tried)
    if max((one.q.max() for one in scores if one.testable), default=0.0) < SEEN:
        return None, [], "none is significant"
    return _judged(track, fit, _likeliest(scores, tried)[:FEW_REFITTED], len(tried), CERTAIN, seed, SUPPORTED)


def _judged(
    track: Track,
    fit: Fit,
    best: tuple[Candidate, ...],
    tried: int,
    alpha: float,
    seed: int,
    confirmed: float = CONFIRMED,
) -> tuple[Hit | None, list[Hit], str]:
    """The same of the ``best`` of so many that were ``tried``, ``confirmed`` by so large a deviate of held-out data."""
    problem, family = track.problem, tried + track.family
    hits = [h for h in search(problem, fit, best, seed, family, tones=False) if h.log_p < math.log(alpha)]
    reason = "none is significant"
    for hit in hits[:MOST_JUDGED]:
        told = _plainest(hit, hits)
        against = _against(track, fit, told, alpha, seed, confirmed)
        if not against:
            return told, hits, ""
        reason = against if hit is hits[0] else reason
    return None, hits, reason


def _instead(
    track: Track, search_on: Callable[[Fit], tuple[Hit | None, list[Hit], str]], beside: Hit | None, alpha: float
) -> FoundFormula | None:
    """A formula in the place of all effects that were added, where it explains more than they do; else None.

    The looks of both are paid for. None of the effects may be significant beside it.
    """
    problem, steps = track.problem, [s for s in track.steps if not s.hit.candidate.generic]
    fit = _refitted(track, track.prepared.model)
    found, hits, _ = search_on(fit)
    if found is None:
        return None
    base = reference(problem, fit.model, fit.noise.power)
    named = (*fit.model, *(s.hit.term for s in steps))
    spent = sum(s.hit.spent for s in steps)
    rank = likelihood_ratio(problem, base, named)[0] - spent + (beside.rank if beside is not None else 0.0)
    if found.rank < rank + TOLD:
        return None
    larger = solve(problem, with_term(fit.model, found.term), start=fit.noise.power)
    with_it = reference(problem, larger.model, larger.noise.power)
    again = [at_shape(problem, larger, with_it, s.hit, s.hit.term) for s in steps]
    if any(hit.log_p < math.log(alpha) for hit in again):
        return None
    return replace(_found(problem, fit, found, hits), instead_of=tuple(s.hit.candidate.effect.key for s in steps))


def testable(problem: Problem, fit: Fit, formulas: tuple[Product, ...]) -> tuple[Candidate, ...]:
    """Those of the formulas that a recording can show, as candidates of the search."""
    instrument: Instrument = "accelerometer" if problem.unit == "m/s^2" else "gyro"
    drivers = set(_drivers(problem, instrument))
    size = float(np.std(problem.y - fit.predicted()[: len(problem.y)])) or 1e-9
    barred = () if _never_slow(problem) else ("1/u",)
    longest = max(problem.exposures, key=lambda e: e.motion.n)
    # Of each factor once: hundreds of products are made of some thirty.
    means = cache(lambda text: FACTORS[text].means(longest.u, longest.motion, "formula"))
    effects = [
        _scaled(formula.of(lambda factor: means(factor.text)), formula, instrument, size)
        for formula in formulas
        if all((f.driver in drivers or f.text in drivers) and f.text not in barred for f in formula.factors)
    ]
    slow = (_without_filters(one) for one in candidates(problem, tuple(effects))[0])
    return tuple(one for one in slow if one.terms)


def _without_filters(one: Candidate) -> Candidate:
    """The candidate, an after-effect without time constants of an output's filter: none where a run is short."""
    if one.effect.title != AFTER_EFFECT:
        return one
    return replace(one, terms=tuple(term for term in one.terms if term.shape[0] > SLOWEST))


def _drivers(problem: Problem, instrument: Instrument) -> Iterator[str]:
    """Drivers that this recording has, and texts of waves of the angle that it turns through."""
    yield "t"
    motions = [e.motion for e in problem.exposures]
    if all(m.has("temperature") for m in motions):
        yield from ("T",) if problem.in_points else ("T", "dT/dt")
    if instrument == "accelerometer":
        return
    if problem.turns:
        yield "u"
        if all(m.has("rate_edges") for m in motions) and not problem.in_points:
            yield "du/dt"
    for order in (1, 2, 3, 4):
        if candidates(problem, (AngleLockedRate(order),))[0]:
            yield f"cos({'' if order == 1 else f'{order} '}a + p)"
    for letter, field, effect in (("f", "force", GSensitivity()), ("v", "vibration", VibrationRectification())):
        if candidates(problem, (effect,))[0]:
            yield from (f"{letter}_{axis}" for axis in "xyz" if all(m.has(f"{field}.{axis}") for m in motions))


def _never_slow(problem: Problem) -> bool:
    """Whether the table stands or goes at rates of one order: one over the rate is then told from its ramps."""
    rates = np.concatenate([np.abs(np.ravel(e.u)) for e in problem.exposures])
    moving = rates[rates > STANDS]
    return len(moving) > 0 and float(np.quantile(moving, 0.02)) >= LEAST_RATE * float(moving.max())


def _scaled(columns: tuple[Floats, ...], formula: Product, instrument: Instrument, size: float) -> Effect:
    """The effect of a formula, with a prior by which it makes no more of the reading than what is left of it."""
    most = [float(np.sqrt(np.mean(np.square(c)))) for c in columns]
    most = most if any(f.free for f in formula.factors) else [max(most)] * len(most)  # of a wave both are one
    sds = tuple(float(f"{3 * size / max(one, 1e-30):.2g}") for one in most)
    return made(formula.text, instrument, sds, name_of(formula.text))


def _likeliest(scores: list[Scores], tried: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
    """The candidates with the best scores."""
    value = np.array([s.q.max() / max(s.rank, 1) if s.testable else -1.0 for s in scores])
    return tuple(tried[i] for i in np.argsort(-value)[:MOST_REFITTED] if value[i] > 0)


def _formula(hit: Hit) -> Product:
    text: str = hit.candidate.effect.formula  # type: ignore[attr-defined]
    return product(text)


def _plainest(best: Hit, hits: list[Hit]) -> Hit:
    """The plainest of those that are as good as one."""
    able = [h for h in hits if _gain(h) >= _gain(best) - AS_WELL]
    return min(able, key=lambda h: (_formula(h).simplicity, -_gain(h)), default=best)


def _gain(hit: Hit) -> float:
    """Twice the gain in log likelihood, less what parameters gain by chance."""
    return hit.likelihood_ratio - 2 * hit.size


def _against(track: Track, fit: Fit, hit: Hit, alpha: float, seed: int, confirmed: float) -> str:
    """Why a significant formula is not told; empty if it is."""
    problem, text = track.problem, _formula(hit).text
    if hit.held_out < confirmed:
        return f"{text} follows the fitted data, and held-out data do not confirm it"
    larger = solve(problem, with_term(fit.model, hit.term), start=fit.noise.power)
    before, after = held_out_score(problem, fit), held_out_score(problem, larger)
    if not confirms(before, after, rescored(problem, fit, larger.noise.power)) or after.rms >= before.rms:
        return f"{text} follows the fitted data, but held-out data are worse with it"
    if unclear := unsized(problem, larger, hit.term, held_out=hit.held_out):
        return f"{text} follows the data, but {unclear}"
    curves, _ = candidates(problem, (SplineTime(), SplineTemperature(), SplineRate()))
    left = [h for h in search(problem, larger, curves, seed, track.family, tones=False) if h.log_p < math.log(alpha)]
    if left:
        return f"{text} explains a part; {left[0].candidate.effect.key} would still explain more beside it"
    return ""


def _found(problem: Problem, fit: Fit, hit: Hit, hits: list[Hit]) -> FoundFormula:
    larger = solve(problem, with_term(fit.model, hit.term), start=fit.noise.power)
    alike = [
        _formula(h).text
        for h in sorted(hits, key=lambda h: -_gain(h))
        if h is not hit and _gain(h) >= _gain(hit) - TOLD
    ]
    return FoundFormula(
        _formula(hit).text,
        estimates(problem, larger, (hit.term,))[hit.term],
        hit.p_value,
        hit.likelihood_ratio,
        tuple(alike),
        held_out_score(problem, fit).rms,
        held_out_score(problem, larger).rms,
    )
