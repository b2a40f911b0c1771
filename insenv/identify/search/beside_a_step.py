"""Slow laws that foretell held-out data far better than a step of the bias does that was named in their place.

Of a unit at rest a walk of the noise takes up what goes on slowly in the fitted rows, and a step is what is left to be
seen. A law that few of these rows call for, and which leaves held-out data better by `BETTER` than the step does, is
its rival: a walk that happens to go on so does that too, and so it is no more.
"""

from __future__ import annotations

from dataclasses import replace

from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import held_out_score
from insenv.identify.search.all_rows import may_move_bias
from insenv.identify.search.jumps import is_step
from insenv.identify.search.rivals import Rivalry
from insenv.identify.search.round import by_fit_alone, with_term
from insenv.identify.search.scan import Hit, reference
from insenv.identify.search.settle import dropped
from insenv.identify.search.tracks import Step, Track

#: Share by which the held-out error is less than with the step.
BETTER = 0.2


def beside_steps(track: Track) -> Track:
    """The track at the end of its search, with such laws among the rivals of its steps."""
    if track.problem.turns:
        return track
    pairs = zip(track.steps, track.rivalries, strict=False)
    rivalries = tuple(_with_laws(track, step, rivals) for step, rivals in pairs)
    return replace(track, rivalries=rivalries)


def _with_laws(track: Track, step: Step, rivals: Rivalry) -> Rivalry:
    if not is_step(step.hit.candidate.effect):
        return rivals
    return rivals.beside(hit.term for hit in _foretelling(dropped(track, step, ""), track.score.rms))


def _foretelling(track: Track, error: float) -> list[Hit]:
    """Slow laws with which held-out data are far better than ``error`` beside all else, the best first."""
    problem, fit = track.problem, track.fit
    able = tuple(c for c in track.candidates if may_move_bias(c.effect) and not is_step(c.effect))
    able = tuple(c for c in able if all(c.effect.id != term.effect.id for term in fit.model))
    hits = by_fit_alone(
        problem, fit, reference(problem, fit.model, fit.noise.power), able, 0, track.family, tones=False
    )

    def left(hit: Hit) -> float:
        return held_out_score(problem, solve(problem, with_term(fit.model, hit.term), start=fit.noise.power)).rms

    scores = sorted(((left(hit), index) for index, hit in enumerate(hits)))
    return [hits[index] for score, index in scores if score < (1 - BETTER) * error]
