r"""What two laws of the temperature tell together: a thermometer behind the sensor, or a sensor behind the thermometer.

Of a first-order thermometer, tau dT/dt = T_true - T, and of a part that follows the thermometer, tau dL/dt = T - L,

    bias = k T_true = k T + k tau dT/dt
    bias = k L      = k T - k (T - L)

a law of the temperature and one of its change. By itself neither may explain much, and what is likeliest of the single
ones, a lag of hours, a step, a walk of the noise, is neither. So both are tried in the place of what was added that is
thermal or slow, and beside nothing. They stay where each is significant beside the other, and where, each further
coefficient and shape paid for, they explain more by `MORE` and held-out data are no worse, or explain as much and
held-out data are better by `BETTER`. Where a lag as long as the record stays, the temperature itself is its rival.
"""

from __future__ import annotations

import math
from dataclasses import replace

from insenv.effects.thermal import BiasTemperature, BiasTemperatureRate, BiasThermalLag
from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import held_out_score
from insenv.identify.fit.problem import Model
from insenv.identify.search.rivals import RICHER_GAIN
from insenv.identify.search.round import at_shape, by_fit_alone
from insenv.identify.search.scan import Hit, likelihood_ratio, reference
from insenv.identify.search.size import unsized
from insenv.identify.search.tracks import Step, Track
from insenv.identify.search.unit.one_box import DRIFTS, is_thermal

#: By how much more the likelihood ratio of both is, beyond what further coefficients gain; share by which the held-out
#: error is less where it is no more.
MORE, BETTER = 10.0, 0.05
#: Share of the longest run from which on a lag is as good as none: what is left of the temperature is the temperature.
LONG = 0.5
#: The law, and what goes with it.
LAW, CHANGES = f"{BiasTemperature.id}:1", (BiasTemperatureRate.id, BiasThermalLag.id)
THERMAL = (BiasTemperature.id, *CHANGES)


def behind_the_sensor(track: Track, alpha: float) -> Track:
    """The track with a law of the temperature and one of its change in the place of what is slow, if they tell more."""
    gone = tuple(s for s in track.steps if _is_slow(s))
    stays = tuple(t for t in track.fit.model if all(t is not s.hit.term for s in gone))
    known = any(term.effect.id in THERMAL for term in stays)
    law = next((hit for hit in track.last_physical or track.hits or () if hit.candidate.effect.key == LAW), None)
    if law is None or known or any(s.together for s in gone):
        return track
    beside = solve(track.problem, (*stays, law.term), start=track.fit.noise.power)
    base = reference(track.problem, beside.model, beside.noise.power)
    tried = tuple(c for c in track.candidates if c.effect.key in CHANGES)
    others = by_fit_alone(track.problem, beside, base, tried, 0, track.family, tones=False)
    likeliest = sorted(others, key=lambda hit: -hit.rank)
    pairs = (_with_pair(track, stays, gone, (law, other), alpha) for other in likeliest)
    return next((found for found in pairs if found is not track), track)


def beside_a_long_lag(track: Track) -> Track:
    """The track with the temperature itself as a rival of a lag that is as long as the record, if held-out data may be.

    A walk of the noise takes up what either leaves, and so tells them apart where nothing else does.
    """
    span = max(e.motion.dt * e.motion.n for e in track.problem.exposures)
    law = next((c for c in track.candidates if c.effect.key == LAW), None)
    rivalries = list(track.rivalries)
    for index, (step, rivals) in enumerate(zip(track.steps, track.rivalries, strict=False)):
        term = step.hit.term
        if law is None or term.effect.id != BiasThermalLag.id or term.shape[0] < LONG * span or LAW in rivals.keys:
            continue
        other = tuple(law.terms[0] if one is term else one for one in track.fit.model)
        score = held_out_score(track.problem, solve(track.problem, other, start=track.fit.noise.power))
        if score.rms <= (1 + BETTER) * track.score.rms:
            rivalries[index] = rivals.beside(law.terms[:1], first=True)
    return replace(track, rivalries=tuple(rivalries))


def _with_pair(track: Track, stays: Model, gone: tuple[Step, ...], pair: tuple[Hit, Hit], alpha: float) -> Track:
    """The track with both in the place of what is gone, where they explain more; else as it is."""
    problem, both = track.problem, (*stays, *(hit.term for hit in pair))
    base = reference(problem, stays, track.fit.noise.power)
    gained = likelihood_ratio(problem, base, both)[0] - likelihood_ratio(problem, base, track.fit.model)[0]
    gained -= RICHER_GAIN * (sum(hit.size for hit in pair) - sum(s.hit.size for s in gone))
    if gained < (0 if gone else MORE):
        return track
    fit = solve(problem, both, start=track.fit.noise.power)
    score = held_out_score(problem, fit)
    if score.rms > track.score.rms * (1 if gained >= MORE else 1 - BETTER):
        return track
    each = [_beside(track, stays, *two) for two in (pair, pair[::-1])]
    sure = all(hit.log_p < math.log(alpha) and not unsized(problem, fit, hit.term, looks=hit.looks) for hit in each)
    if not sure:
        return track
    before = held_out_score(problem, solve(problem, stays, start=track.fit.noise.power))
    steps = tuple(s for s in track.steps if all(s is not one for one in gone))
    steps = (*steps, *(Step(hit, before, score, hit.p_value) for hit in each))
    return replace(track, fit=fit, score=score, steps=steps, rivalries=())


def _is_slow(step: Step) -> bool:
    effect = step.hit.candidate.effect
    return not effect.of_rate and (is_thermal(effect) or effect.id in DRIFTS or effect.of_time)


def _beside(track: Track, stays: Model, hit: Hit, other: Hit) -> Hit:
    """The hit beside the other one and what stays."""
    fit = solve(track.problem, (*stays, other.term), start=track.fit.noise.power)
    base = reference(track.problem, fit.model, fit.noise.power)
    return at_shape(track.problem, fit, base, hit, hit.term)
