"""One round of the search: every candidate by likelihood ratio, shapes refined, in order of significance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from insenv.core.quantities import unit_for
from insenv.core.recording import Floats
from insenv.effects.angle import EncoderHarmonic
from insenv.effects.base import CurveEffect, Effect, MemoryEffect
from insenv.effects.rate.scale import ScaleFactor
from insenv.effects.timing import SampleHold
from insenv.effects.tone import Tone
from insenv.identify.clean.holds import RENEWALS, effective
from insenv.identify.clean.settling import only_time
from insenv.identify.fit.evidence import held_out_deviate, joint_deviate, log_tail
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.prepare.spectral.cycles import each_cycle
from insenv.identify.prepare.spectral.lines import coherent_power, multiple, strongest_tone, within_half_a_count
from insenv.identify.search.artefacts.folded import folded
from insenv.identify.search.artefacts.levels_of_runs import between_runs, not_told_by_gains, not_told_by_levels
from insenv.identify.search.artefacts.recurrence import (
    comes_and_goes,
    not_both_ways,
    not_in_all_runs,
    of_a_rest,
    of_few_means,
)
from insenv.identify.search.artefacts.reference_errors import beside_reference_errors
from insenv.identify.search.artefacts.rounded import beside_rounding, beside_steps, damped_as_steps
from insenv.identify.search.candidates import Candidate, unseen
from insenv.identify.search.scan import (
    SHAPES_REFITTED,
    Hit,
    Reference,
    Scores,
    deviate,
    likelihood_ratio,
    reference,
    score,
    term_freedom,
)
from insenv.identify.search.unit.shaken import beside_shaking

#: Frequencies at most that a tone is tried at, of those that blocks far apart tell from each other.
MOST_LOBES = 64
#: Share beyond its least credible value within which a shape stands at it.
EDGE = 0.01
#: Likelihood ratio by which a shape that contradicts its coefficients is told from one that does not.
NEARER = 6.0
#: Times that a shape is moved to where it does not: of a dead band the depth hardly changes with the threshold.
MOVED = 3
#: Candidates whose shapes are refined, best first.
REFINED = 4
#: What refining shapes and choosing among held-out deviates adds to the looks: with it 5 of 300 simulated recordings
#: that lacked nothing had something added at a nominal 1 % (docs/results/search_study.md).
CALIBRATION = 2.0
#: Further looks of an effect that one single event looks like: noise is taken for Gaussian, and the slow noise of real
#: instruments jumps and settles by itself. Without it 13 % of 180 pieces of 1000 s of MEMS accelerometers at rest had
#: a step or a warm-up named at a nominal 1 % (docs/method.md).
EVENTS = 1000.0
#: Further looks of an effect that is rarer by far than others that look like it: the odds against it. To be named first
#: it must be likelier by as much.
UNUSUAL = 20.0
#: A candidate that fitted data alone would give a larger p-value than this is not put to the held-out data.
SUGGESTED = 0.3
#: Share of the input's square sum from which a tone at its frequency is the motion itself.
OF_MOTION = 0.5
#: Parabolas at most by which a shape is refined, and what a further one must add to the likelihood ratio.
MOST_PARABOLAS, WORTH = 12, 0.002
#: Multiples of that frequency that curves of the motion have.
HARMONICS = 8
#: Share of an encoder's step that a wave of it is at least, and deviations that tell a finer one.
PART_OF_A_STEP, FINE = 0.1, 6.0


def search(
    problem: Problem, fit: Fit, found: tuple[Candidate, ...], seed: int, family: int, tones: bool = True
) -> list[Hit]:
    """Every testable candidate, and a tone if asked for, added to ``fit.model`` at its best shape, best first.

    ``family`` is the number of candidates of the whole search, later passes included: what p-values are corrected for.
    """
    base = problem.remember_last("reference", fit, lambda: reference(problem, fit.model, fit.noise.power))
    hits = by_fit_alone(problem, fit, base, found, seed, family, tones)
    asked = (_consistent(problem, fit, base, confronted(problem, fit, base, hit)) for hit in hits)
    return sorted(asked, key=lambda hit: -hit.rank)


def by_fit_alone(
    problem: Problem, fit: Fit, base: Reference, found: tuple[Candidate, ...], seed: int, family: int, tones: bool
) -> list[Hit]:
    """The same by the fitted data, the shapes of the best ones refined; held-out data are not asked."""
    scores = score(problem, fit, found, seed)
    count = CALIBRATION * family
    hits = [_hit(problem, base, c, s, count) for c, s in zip(found, scores, strict=True) if s.testable]
    if tones:  # asked again with the curves that explain without naming a cause, of the same fit
        hits.append(problem.remember_last(("line", count), fit, lambda: _tone_hit(problem, fit, base, count)))
    hits.sort(key=lambda hit: -hit.rank)
    best = [hit if hit.candidate.effect.line else refined(problem, base, hit) for hit in hits[:REFINED]]
    return best + hits[REFINED:]


def confronted(problem: Problem, fit: Fit, base: Reference, hit: Hit) -> Hit:
    """The hit with the evidence of the held-out data joined in, where the fitted data at all suggest it.

    A coefficient beyond what is credible for its effect takes the hit out: another cause imitates it.
    """
    if log_tail(hit.deviate) > np.log(SUGGESTED):
        return hit
    limits = None if problem.most is None else problem.most.tobytes()
    noise = (limits, fit.noise.power.tobytes(), base.noise.power.tobytes(), base.noise.loglik)
    own = (hit.candidate.effect.key, hit.term, hit.likelihood_ratio, hit.looks, hit.deviate, hit.size, hit.remark)
    key = ("confronted", fit.model, base.model, *noise, *own)
    judged: Hit = problem.remember(key, lambda: _confronted(problem, fit, base, hit))
    return judged


def _confronted(problem: Problem, fit: Fit, base: Reference, hit: Hit) -> Hit:
    larger = solve(problem, with_term(fit.model, hit.term), start=fit.noise.power)
    beyond = _beyond_bounds(problem, larger) or _contradicted(problem, base, larger)
    if why := _no_law_of_any_size(problem, fit, base, larger):
        return replace(hit, deviate=-np.inf, remark=beyond or why)
    freedom = term_freedom(problem, base, hit.term)
    z, information = held_out_deviate(problem, fit, larger, freedom)
    joint = joint_deviate(log_tail(hit.deviate), hit.likelihood_ratio, z, information)
    hit = beside_rounding(problem, larger, replace(hit, deviate=joint, held_out=z, alone=0.0, unrounded=0.0))
    hit = hit if damped_as_steps(problem, hit.term) else beside_steps(problem, larger, hit)
    hit = beside_reference_errors(problem, fit, base, beside_shaking(problem, base, hit))
    if not beyond:
        return hit
    return replace(hit, deviate=-np.inf, remark=beyond, incredible=hit.deviate, alone=0.0, unrounded=0.0)


def no_law(problem: Problem, fit: Fit, base: Reference, larger: Fit) -> str:
    """Why the last term of a ``larger`` model than that of ``fit`` is no effect of the instrument; empty if it may be.

    Its coefficients are not credible, or what it explains is not the same in all of the recording.
    """
    beyond = _beyond_bounds(problem, larger) or _contradicted(problem, base, larger)
    return beyond or _no_law_of_any_size(problem, fit, base, larger)


def _no_law_of_any_size(problem: Problem, fit: Fit, base: Reference, larger: Fit) -> str:
    """The same, whatever its coefficients are."""
    term = larger.model[-1]
    return (
        _over_at_once(term, problem.unit)
        or _leads(larger)
        or seldom_renewed(problem, term)
        or _counts(problem, larger)
        or _finer_than_steps(problem, larger)
        or folded(problem, larger)
        or unseen(problem, term.effect, term.shape)
        or of_few_means(problem, fit, term)
        or not_told_by_levels(problem, fit, term)
        or (not_told_by_gains if between_runs(problem, term) else not_in_all_runs)(problem, fit, term)
        or not_both_ways(problem, fit, base, term)
        or of_a_rest(problem, fit, term)
        or comes_and_goes(problem, fit, term)
    )


def _beyond_bounds(problem: Problem, fit: Fit) -> str:
    """Why the last term's coefficients are not credible; empty if they are."""
    params = {p.name: p for p in fit.model[-1].effect.linear}
    for j in np.flatnonzero(fit.design.term == len(fit.model) - 1):
        name = fit.design.labels[j][1].partition("[")[0]
        low, high = problem.limits(params[name])
        value, slack = float(fit.theta[j]), 3 * float(fit.sd[j])
        si, most = params[name].unit_on(problem.unit), high if value > 0 else -low
        would, bounds = f"its {name} would be {unit_for(si, value).show(value)}", unit_for(si, low, high)
        # Of what has one sign alone, noise gives either: the other one is no finding, however uncertain.
        if not (low if low == 0 else low - slack) <= value <= high + slack:
            return f"{would}, beyond the credible {bounds.number(low)} to {bounds.show(high)}"
        if most < slack <= abs(value):
            return f"{would}, but even {bounds.show(most)}, the largest credible, would not stand out"
        if abs(value) + slack < params[name].least:
            least = params[name].least
            unit = unit_for(si, least)
            return f"its {name} would be {unit.show(value)}, less than the credible {unit.show(least)}"
    return ""


def _contradicted(problem: Problem, base: Reference, fit: Fit) -> str:
    """Why the last term's coefficients and shapes together are none; empty if they, or others as likely, may be."""
    why, shape = _contradiction(fit)
    if not why or not shape or min(shape) <= 0:
        return why
    other = (*fit.model[:-1], Term(fit.model[-1].effect, shape))
    lost = likelihood_ratio(problem, base, fit.model)[0] - likelihood_ratio(problem, base, other)[0]
    return why if lost > NEARER else ""


def _consistent(problem: Problem, fit: Fit, base: Reference, hit: Hit) -> Hit:
    """The hit with shapes that do not contradict its coefficients, where these are nearly as likely; else as it is.

    What is told of it then may be: of a dead band that would lose a seventh of the rates below it both were stated.
    """
    for _ in range(MOVED if hit.log_p < 0 else 0):
        larger = solve(problem, with_term(fit.model, hit.term), start=fit.noise.power)
        why, shape = _contradiction(larger)
        if not why or not shape or min(shape) <= 0:
            break
        hit = at_shape(problem, fit, base, hit, replace(hit.term, shape=shape))
    return hit


def _contradiction(fit: Fit) -> tuple[str, tuple[float, ...]]:
    """Why the last term's coefficients and shapes together are none, and the nearest shapes that would be; or empty."""
    term = fit.model[-1]
    theta = fit.theta[fit.design.term == len(fit.model) - 1]
    if not isinstance(term.effect, CurveEffect) or term.per_run or len(theta) != len(term.effect.linear):
        return "", ()
    parameters = np.concatenate([theta, term.shape])
    return term.effect.contradiction(parameters), term.effect.consistent(parameters)


def _over_at_once(term: Term, unit: str) -> str:
    """Why a course of time, or what remembers, is none: it is over as soon as the least credible is; empty if it lasts.

    A memory that is over at once is a law of the rate itself beside a reference with noise, or what a lag leaves.
    """
    effect = term.effect
    remembers = isinstance(effect, MemoryEffect) and not effect.of_response
    what = "an event" if effect.of_time else "no memory"
    for param, value in zip(effect.shapes, term.shape, strict=True) if effect.of_time or remembers else ():
        if 0 < value <= param.low * (1 + EDGE):
            least = unit_for(param.unit_on(unit), value).show(value)
            return f"its {param.name} would be {least}, the least that is credible, or less: {what}"
    return ""


def _counts(problem: Problem, fit: Fit) -> str:
    """Why a line that was fitted last is none: its angle is less than half a count of the readings; empty if more."""
    term = fit.model[-1]
    if not term.effect.line or not problem.counter:
        return ""
    amplitude = float(np.linalg.norm(fit.theta[fit.design.term == len(fit.model) - 1]))
    if not within_half_a_count(amplitude, term.shape[0], problem.counter):
        return ""
    share = amplitude / (2 * np.pi * term.shape[0]) / problem.counter
    return f"its angle is {share:.2g} of a count of the readings: a counter's pattern"


def _finer_than_steps(problem: Problem, fit: Fit) -> str:
    """Why a wave of the encoder that was fitted last is none: it is a small part of a step; empty if it is more.

    Many deviations tell a finer one. In 500 simulated tables two waves of fewer were named of less than a tenth of a
    step, and neither was there.
    """
    if not problem.encoder or not isinstance(fit.model[-1].effect, EncoderHarmonic):
        return ""
    own = fit.design.term == len(fit.model) - 1
    amplitude, deviates = float(np.linalg.norm(fit.theta[own])), np.abs(fit.theta[own]) / fit.sd[own]
    if amplitude >= PART_OF_A_STEP * problem.encoder or float(deviates.max()) > FINE:
        return ""
    return f"it would be {amplitude / problem.encoder:.1g} of a step of the encoder, which shows none so fine"


def _leads(fit: Fit) -> str:
    """Why a hold that was fitted last is none: it adds what a held output would take away; empty if it does not."""
    if not isinstance(fit.model[-1].effect, SampleHold):
        return ""
    theta, term = fit.theta, fit.design.term
    gain = 1 + sum(theta[term == j].sum() for j, one in enumerate(fit.model) if isinstance(one.effect, ScaleFactor))
    share = float(theta[term == len(fit.model) - 1][0])
    return f"its share would be {share:.2g} of a gain of {gain:.2g}: what leads is not held" if share * gain < 0 else ""


def seldom_renewed(problem: Problem, term: Term) -> str:
    """Why a hold is none: few renewals tell it, and jumps that come late by times of their own do; empty if many do."""
    if not isinstance(term.effect, SampleHold):
        return ""
    made, bins = problem.columns(term)[:, 0] ** 2, problem.bins
    _, each = np.unique(np.column_stack([bins.run, bins.time // term.shape[0]]), axis=0, return_inverse=True)
    told = effective(np.bincount(each.ravel(), np.where(bins.held_out, 0.0, made)))
    return f"it would be told by {told:.2g} renewals: jumps that come late do that" if told < RENEWALS else ""


def at_shape(problem: Problem, fit: Fit, base: Reference, hit: Hit, term: Term) -> Hit:
    """The hit at another shape of its candidate."""
    ratio, gained = likelihood_ratio(problem, base, with_term(base.model, term))
    moved = replace(hit, term=term, likelihood_ratio=ratio, deviate=deviate(problem, base, term, ratio, gained))
    return confronted(problem, fit, base, moved)


def with_term(model: Model, term: Term) -> Model:
    """The model with ``term`` added; columns that the model has already are dropped by the design."""
    return (*model, term)


def _hit(problem: Problem, base: Reference, candidate: Candidate, scores: Scores, count: float) -> Hit:
    order = np.argsort(-scores.q)[:SHAPES_REFITTED]
    tried = []
    for index in order:
        if scores.q[index] < 0:
            continue
        term = candidate.terms[index]
        ratio, gained = likelihood_ratio(problem, base, with_term(base.model, term))
        tried.append((ratio, gained, term))
    ratio, gained, term = max(tried, key=lambda row: row[0])
    size = min(term.size, gained + len(term.shape))
    looks = scores.trials * count * against(problem, candidate.effect)
    return Hit(candidate, term, ratio, looks, deviate(problem, base, term, ratio, gained), size)


def against(problem: Problem, effect: Effect) -> float:
    """Odds against an effect, before any data: further looks of it."""
    events = effect.sudden and only_time(problem)
    return (EVENTS if events else 1.0) * (UNUSUAL if effect.unusual else 1.0)


def _tone_hit(problem: Problem, fit: Fit, base: Reference, count: float) -> Hit:
    frequency, trials = strongest_tone(problem, fit)
    resolution = 0.25 / max(b.n for b in problem.fitted) / problem.bins.width
    term = Term(Tone(), (frequency,), per_run=len(problem.exposures) > 1)
    term, ratio, gained = _coherent(problem, fit, base, term, resolution)
    found = deviate(problem, base, term, ratio, gained)
    best = Hit(Candidate(Tone(), (term,)), term, ratio, trials * count, found, term.size)
    if _of_the_motion(problem, term):
        return replace(
            best,
            deviate=-np.inf,
            remark="at a multiple of the frequency at which the motion repeats: of the motion, and no line",
        )
    return refined(problem, base, best, np.array([min(resolution, 0.25 / _span(problem))]))


def _of_the_motion(problem: Problem, term: Term) -> bool:
    """Whether a tone stands where a table swings, or its motion repeats, in any run, or at a multiple of that.

    What follows such a motion, its angle or rate by any curve, has lines there and nowhere else.
    """
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    swings = (swing for run in _runs(problem) if (swing := _swing(u[run], problem.bins.width)) is not None)
    swung = any(multiple(term.shape[0], at, HARMONICS, near) for at, near in swings)
    return swung or each_cycle(problem, term.shape[0]) > 0


def _runs(problem: Problem) -> list[NDArray[np.int64]]:
    """Bins of each run."""
    return [np.flatnonzero(problem.bins.run == run) for run in range(len(problem.exposures))]


def _swing(u: Floats, width: float) -> tuple[float, float] | None:
    """Frequency [Hz] at which a run has more than half of its input, and its resolution; None where it has no such."""
    u = u - u.mean() if len(u) else u
    total = float(u @ u)
    if not total or len(u) < 8:
        return None
    power = np.abs(np.fft.rfft(u)) ** 2
    power[0] = 0.0  # what rounding leaves of a constant rate is no swing
    near = np.convolve(power, np.ones(3), mode="same")  # of a line between two frequencies of the transform
    at = int(np.argmax(near[1:])) + 1
    if 2 * float(near[at]) / len(u) < OF_MOTION * total:
        return None
    around = np.arange(max(at - 1, 1), min(at + 2, len(power)))
    return float(power[around] @ around / power[around].sum()) / (len(u) * width), 1 / (len(u) * width)


def _span(problem: Problem) -> float:
    """Longest time from the first to the last fitted bin of a run [s]."""
    time = problem.bins.time
    ends = [time[[b.start, b.stop - 1]] for b in problem.fitted]
    runs = {b.run for b in problem.fitted}
    spans = [np.concatenate([e for e, b in zip(ends, problem.fitted, strict=True) if b.run == r]) for r in runs]
    return max(float(np.ptp(s)) for s in spans) + problem.bins.width


def _coherent(problem: Problem, fit: Fit, base: Reference, term: Term, resolution: float) -> tuple[Term, float, int]:
    """The tone at the best frequency near that of ``term``, its likelihood ratio, and the parameters gained.

    Several blocks of a run tell a frequency as sharply as the time from the first to the last, with lobes beside. Short
    blocks far apart have thousands: of those the ones with most power are tried.
    """
    step = 0.25 / _span(problem)
    count = int(np.ceil(2 * resolution / step)) if step < 0.9 * resolution else 0
    best = (term, *likelihood_ratio(problem, base, (*base.model, term)))
    frequencies: Floats = term.shape[0] + step * np.arange(-count, count + 1.0) if count else np.empty(0)
    if len(frequencies) > MOST_LOBES:
        strongest = np.argsort(coherent_power(problem, fit, frequencies))[-MOST_LOBES:]
        frequencies = frequencies[np.sort(strongest)]
    lobes = [replace(term, shape=(frequency,)) for frequency in frequencies.tolist()]
    problem.transformed_together(lobes)
    for moved in lobes:
        tried = likelihood_ratio(problem, base, (*base.model, moved))
        if tried[0] > best[1]:
            best = (moved, *tried)
        problem.forget(moved)
    return best


def refined(problem: Problem, base: Reference, hit: Hit, step: Floats | None = None) -> Hit:
    """The hit with its shape moved off the grid to the best likelihood ratio."""
    start = np.array(hit.term.shape)
    if not len(start):
        return hit
    steps = _grid_steps(hit.candidate, start) if step is None else step
    least = np.minimum([param.low for param in hit.term.effect.shapes], start)

    def gain(x: Floats) -> float:
        shape = np.maximum(start + steps * np.clip(x, -1, 1), least)
        term = replace(hit.term, shape=tuple(map(float, shape)))
        ratio, _ = likelihood_ratio(problem, base, with_term(base.model, term))
        problem.forget(term)
        return ratio - 1e3 * float(np.sum(np.maximum(np.abs(x) - 1, 0) ** 2))

    best = _of_one(gain, hit.likelihood_ratio) if len(start) == 1 else _of_several(gain, len(start))
    shape = np.maximum(start + steps * np.clip(best, -1, 1), least)
    term = replace(hit.term, shape=tuple(map(float, shape)))
    ratio, gained = likelihood_ratio(problem, base, with_term(base.model, term))
    if ratio <= hit.likelihood_ratio:
        return hit
    return replace(hit, term=term, likelihood_ratio=ratio, deviate=deviate(problem, base, term, ratio, gained))


def _of_one(gain: Callable[[Floats], float], at_zero: float) -> Floats:
    """Where a gain is largest between -1 and 1: by parabolas through the best three points, no wider than they lie."""
    known = {0.0: at_zero, **{x: gain(np.array([x])) for x in (-0.5, -0.25, 0.25, 0.5)}}
    for _ in range(MOST_PARABOLAS):
        best = max(known, key=lambda x: known[x])
        around = sorted({-1.0, 1.0, *known})
        at = around.index(best)
        low, high = around[max(at - 1, 0)], around[min(at + 1, len(around) - 1)]
        if low in known and high in known and low < best < high:
            x, more = _vertex(*((x, known[x]) for x in (low, best, high)))
            if more < WORTH:
                break
        else:
            x = low if low not in known else high
        if x in known:
            break
        known[x] = gain(np.array([x]))
    return np.array([max(known, key=lambda x: known[x])])


def _vertex(low: tuple[float, float], best: tuple[float, float], high: tuple[float, float]) -> tuple[float, float]:
    """Where the parabola through three points is largest, and how much larger than at the one between."""
    left, right = best[0] - low[0], high[0] - best[0]
    rise, fall = (best[1] - low[1]) / left, (best[1] - high[1]) / right
    bend = (rise + fall) / (left + right)
    slope = (rise * right - fall * left) / (left + right)
    if bend <= 0:
        return best[0], 0.0
    return best[0] + slope / (2 * bend), slope**2 / (4 * bend)


def _of_several(gain: Callable[[Floats], float], shapes: int) -> Floats:
    """The same for several shapes, by a simplex."""
    simplex = np.vstack([np.zeros(shapes), 0.5 * np.eye(shapes)])
    options = {"initial_simplex": simplex, "maxfev": 15 * shapes + 5, "xatol": 0.01, "fatol": 0.02}
    return np.asarray(minimize(lambda x: -gain(x), simplex[0], method="Nelder-Mead", options=options).x)


def _grid_steps(candidate: Candidate, start: Floats) -> Floats:
    """Distance to the nearest other grid value of each shape."""
    grid = np.array([term.shape for term in candidate.terms])
    away = np.abs(grid - start)
    away[away == 0] = np.inf
    steps = away.min(axis=0)
    return np.where(np.isfinite(steps), steps, 0.1 * np.abs(start))
