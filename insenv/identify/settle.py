"""The end of a search: every added effect once more against all others in its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.identify.fit import solve
from insenv.identify.heldout import held_out_score
from insenv.identify.problem import Model
from insenv.identify.rivals import RICHER_GAIN, Rivalry, rivalry
from insenv.identify.scan import Hit
from insenv.identify.search import search
from insenv.identify.tracks import Progress, Refusal, Step, Track
from insenv.identify.uncertainty import estimates

#: Deviations by which a curve of the rate must differ from zero beside a lag of the reference.
LEAST = 3.0


def settled(track: Track, alpha: float, seed: int, progress: Progress) -> Track:
    """Swap each added effect for a better one where there is one, then list what cannot be told from it."""
    track = _beyond_the_lag(track)
    for _ in range(2):
        rivalries = [_rivals_of(track, step, alpha, seed, progress) for step in track.steps]
        swaps = [(s, r.better) for s, r in zip(track.steps, rivalries, strict=True) if r.better is not None]
        track = replace(track, rivalries=tuple(rivalries))
        if not swaps:
            break
        step, better = swaps[0]
        assert better is not None
        track = _swapped(track, step, better)
    return track


def _beyond_the_lag(track: Track) -> Track:
    """The track without curves of the rate that are no larger than they may be off by.

    A reference that was measured comes late, through a filter that nobody knows exactly. What its skew leaves follows
    the rate too.
    """
    problem = track.problem
    if not any(e.motion.lag for e in problem.exposures):
        return track
    while True:
        weak = next((step for step in track.steps if _curve_of_rate(step) and not _large(track, step)), None)
        if weak is None:
            return track
        rest = tuple(term for term in track.fit.model if term is not weak.hit.term)
        fit = solve(problem, rest, start=track.fit.noise.power)
        refusal = Refusal(weak.hit, "less than three of its standard deviations beside a reference that is late")
        steps = tuple(step for step in track.steps if step is not weak)
        score = held_out_score(problem, fit)
        track = replace(track, fit=fit, score=score, steps=steps, refusals=(*track.refusals, refusal))


def _curve_of_rate(step: Step) -> bool:
    effect = step.hit.candidate.effect
    return effect.of_rate and not effect.generic and effect.belongs == "instrument" and not effect.of_time


def _large(track: Track, step: Step) -> bool:
    """Whether an effect is larger than its own deviations, with shapes that are right only nearly."""
    linear = {param.name for param in step.hit.term.effect.linear}
    found = estimates(track.problem, track.fit, tuple(s.hit.term for s in track.steps))[step.hit.term]
    own = [row for row in found if row.parameter.partition("[")[0] in linear and row.sd > 0]
    return max((abs(row.value) / row.sd for row in own), default=np.inf) > LEAST


def _rivals_of(track: Track, step: Step, alpha: float, seed: int, progress: Progress) -> Rivalry:
    if step.hit.candidate.generic:
        return Rivalry((), None)
    progress(f"{track.problem.target}: what else would explain {step.hit.candidate.effect.key}")
    curves = {s.hit.term for s in track.steps if s.hit.candidate.generic}
    others = tuple(t for t in track.fit.model if t is not step.hit.term and t not in curves)
    fit = solve(track.problem, others, start=track.fit.noise.power)
    tried = tuple(c for c in track.candidates if not c.generic and c.effect.key not in _keys(others))
    hits = search(track.problem, fit, tried, seed, track.family, track.tones)
    return rivalry(track.problem, others, step.hit.term, hits, alpha, _gain(track))


def _gain(track: Track) -> float:
    """What each further parameter of a rival must gain.

    Nothing where more noise would do, or where the Earth rate takes up the levels of the rests: an effect that has the
    added one as its limit, as a warm-up has a drift, is then a rival too, for nobody knows the end.
    """
    rests = all(e.motion.projection == 0 for e in track.problem.exposures)
    free = rests and any(t.effect.id == "earth_rate" for t in track.fit.model)
    return 0.0 if free or track.instead else RICHER_GAIN


def _keys(model: Model) -> set[str]:
    return {term.effect.key for term in model}


def _swapped(track: Track, step: Step, better: Hit) -> Track:
    """The track with ``better`` in the place of ``step``, if held-out data agree."""
    model = tuple(better.term if t is step.hit.term else t for t in track.fit.model)
    fit = solve(track.problem, model, start=track.fit.noise.power)
    score = held_out_score(track.problem, fit)
    if score.rms > track.score.rms:
        return track
    steps = tuple(Step(better, s.before, score, better.p_value) if s is step else s for s in track.steps)
    return replace(track, fit=fit, score=score, steps=steps)
