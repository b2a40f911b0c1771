"""Gyros at rest: what the declared model of their means lacks, beside a bias that walks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Floats, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.manifest import Manifest
from insenv.effects.bias import Bias
from insenv.effects.catalogue import by_key
from insenv.effects.noise import RateRandomWalk
from insenv.effects.thermal import BiasTemperature
from insenv.identify.findings import NotTestable, Rejected
from insenv.identify.positions.checks.numbers import silenced
from insenv.identify.positions.evidence import evidence, held_out_errors
from insenv.identify.positions.gyros.means import RestMeans, RestTerm, over_walks, with_walk
from insenv.identify.positions.least_squares import solve
from insenv.identify.positions.model import AXES, Surroundings
from insenv.identify.positions.part import OF_RESTS, SLOW, Part, candidates, declared_of, structure
from insenv.identify.positions.rests import Rest, means
from insenv.identify.positions.search import Doubt, Outcome, Step, search
from insenv.identify.positions.walk import ALLOWED, NEARLY

#: The noise that looks like what is slow.
WALK = RateRandomWalk.id
#: Probability beside white noise from which on a bias is said to go somewhere: flicker alone, of a good MEMS gyro over
#: minutes, had one in a hundred in five of twelve units without any drift.
FLICKERS = 1e-5


def trace_at_rest(
    manifest: Manifest,
    recordings: Sequence[Recording],
    rests: Sequence[Rest],
    reference: tuple[Floats, Surroundings],
    keys: tuple[str, ...] | None,
    alpha: float,
) -> tuple[tuple[Part, ...], float]:
    """The means at rest of each gyro, and the variance of one about what is found, beside its likeliest walk."""
    (forces, around), in_turn = reference, not any(rest.held_out for rest in rests)
    declared = [e for e in declared_of(manifest, "gyro") if e.id in OF_RESTS]
    earth, earth_sd = _earth(recordings, rests, forces)
    y = means(recordings, rests, "gyro") - earth
    held_out = np.array([rest.held_out for rest in rests])
    parts, scatter = [], []
    tried, _ = candidates(tuple(key for key in OF_RESTS if key not in SLOW), declared, around, keys)
    reason = "in the means at rest it looks like a bias that walks at random"
    there = {effect.id for effect in declared}
    blind = tuple(NotTestable(key, (), reason) for key in SLOW if key not in there)
    slow = [key for key in SLOW if key not in there and (key != BiasTemperature.id or around.temperature is not None)]
    untold = [RestTerm(by_key(key)) for key in slow]  # type: ignore[arg-type]
    terms, more = [RestTerm(e) for e in (Bias(), *declared)], [RestTerm(e) for e in tried]  # type: ignore[arg-type]
    runs = np.array([rest.run for rest in rests])
    found = []
    for axis in range(3):
        vertical = earth_sd[:, axis]
        known = np.outer(vertical, vertical) if vertical.any() else None
        problem = RestMeans(y[:, axis], forces, around, ~held_out, held_out | in_turn, np.eye(len(y)), known)
        further = with_walk(problem, [*terms, *more], runs, ALLOWED)
        problem = with_walk(problem, [*terms, *more], runs)
        scatter.append(solve(problem, [*terms, *more]).variance)
        doubts = [Doubt(further, (), "beside a bias that walks as far as these rests allow")]
        doubts += [
            Doubt(problem, (t,), f"beside {t.effect.key}, which these rests do not tell from it") for t in untold
        ]
        outcome = search(problem, terms, more, alpha, doubts)
        found.append((problem, replace(outcome, not_testable=(*outcome.not_testable, *blind))))
    for axis, (problem, outcome) in enumerate(_of_one_cause(found, more, alpha)):
        outcome = _with_slow(problem, outcome, untold, alpha)
        before, after = (over_walks(problem, [*terms, *more], runs, f) for f in (outcome.before, outcome.after))
        outcome = replace(outcome, before=before, after=after)
        silent = silenced(recordings, rests, f"gyro_{AXES[axis]}")
        parts.append(Part(problem, outcome, (*structure(problem, outcome.after, alpha, "rests"), *silent)))
    return tuple(parts), float(np.median(scatter))


def _earth(recordings: Sequence[Recording], rests: Sequence[Rest], forces: Floats) -> tuple[Floats, Floats]:
    """What the axes read of the Earth's rate upward, and its deviation, both of shape (rests, 3) [rad/s].

    Upward it goes with gravity, and is a g-sensitivity of 6e-6 rad/s per m/s^2 in middle latitudes to a gyro that sees
    it. Where no site says the latitude it is none with the deviation Omega / sqrt(3), as it is all over the globe.
    """
    latitudes = [recordings[rest.run].site.latitude for rest in rests]
    rate = np.array([0.0 if latitude is None else EARTH_RATE * np.sin(latitude) for latitude in latitudes])
    sd = np.array([EARTH_RATE / np.sqrt(3) if latitude is None else 0.0 for latitude in latitudes])
    size = np.linalg.norm(forces, axis=1)
    return rate[:, None] * forces / size[:, None], sd[:, None] * forces / STANDARD_GRAVITY


def _of_one_cause(
    found: Sequence[tuple[RestMeans, Outcome]], tried: Sequence[RestTerm], alpha: float
) -> list[tuple[RestMeans, Outcome]]:
    """The searches of three axes, with an effect on those of them that hardly tell it where all together do.

    Their p-values are joined by Fisher's method, -2 sum log p ~ chi-square of six. Source: R. A. Fisher, Statistical
    Methods for Research Workers, 4th ed. (1932), section 21.1.
    """
    joined = list(found)
    for term in tried:
        key = term.effect.key
        told = [{s.term.effect.key: s.p_value for s in out.steps} for _, out in joined]
        asked = [{r.effect: r for r in out.rejected if r.reason.startswith("not significant")} for _, out in joined]
        p = [a.get(key, b[key].p_value if key in b else 1.0) for a, b in zip(told, asked, strict=True)]
        together = float(chdtrc(2 * len(p), -2 * float(np.sum(np.log(np.maximum(p, 1e-300))))))
        for axis, (problem, outcome) in enumerate(joined):
            if together < alpha and key not in told[axis] and p[axis] < NEARLY:
                joined[axis] = problem, _with_another(problem, outcome, term, asked[axis][key], together)
    return joined


def _with_another(problem: RestMeans, outcome: Outcome, term: RestTerm, refused: Rejected, p_value: float) -> Outcome:
    """The outcome with an effect that it refused, where held-out rests are no worse off with it."""
    larger = solve(problem, (*outcome.after.terms, term))
    before, now = held_out_errors(problem, outcome.after, larger)
    if not now <= before:
        return outcome
    step = Step(term, p_value, refused.likelihood_ratio, before, now)
    others = tuple(one for one in outcome.rejected if one is not refused)
    return replace(outcome, after=larger, steps=(*outcome.steps, step), rejected=others)


def _with_slow(problem: RestMeans, outcome: Outcome, slow: Sequence[RestTerm], alpha: float) -> Outcome:
    """The outcome with the slow cause of which means without a walk would be certain, and the walk as its rival.

    That the bias goes is then certain, and why is not; what makes held-out rests worse is none.
    """
    after = outcome.after
    white = replace(problem, root=np.eye(len(problem.y)))
    small = solve(white, after.terms)
    found = [(term, evidence(white, small, solve(white, (*after.terms, term)))) for term in slow]
    level = min(alpha, FLICKERS)
    sure = sorted((e.p_value(len(slow)), i) for i, (_, e) in enumerate(found) if e.p_value(len(slow)) < level)
    for p_value, i in sure[:1]:
        term, told = found[i]
        larger = solve(problem, (*after.terms, term))
        before, now = held_out_errors(problem, after, larger)
        if not now <= before:
            return outcome
        keys = [found[j][0].effect.key for _, j in sure]
        rivals = {**outcome.rivals, keys[0]: (*keys[1:], WALK)}
        blind = tuple(n for n in outcome.not_testable if n.effect not in keys)
        steps = (*outcome.steps, Step(term, p_value, told.likelihood_ratio, before, now))
        return replace(outcome, after=larger, steps=steps, rivals=rivals, not_testable=blind)
    return outcome
