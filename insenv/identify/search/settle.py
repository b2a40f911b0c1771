"""The end of a search: every added effect once more against all others in its place."""

from __future__ import annotations

import math
from dataclasses import replace

from insenv.effects.base import MemoryEffect
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import CHANCE, held_out_score
from insenv.identify.fit.problem import Model
from insenv.identify.search.rivals import RICHER_GAIN, Rivalry, is_plain, rivalry
from insenv.identify.search.round import at_shape, search
from insenv.identify.search.scan import Hit, likelihood_ratio, reference
from insenv.identify.search.size import own_size, unsized
from insenv.identify.search.tracks import Progress, Refusal, Step, Track
from insenv.identify.search.unit.one_box import DOUBT

#: Laws of the rate from which on they may be parts of one curve, and why they have no name then.
SEVERAL = 2
OF_A_CURVE = "it is a part of a curve of the rate that no effect of the catalogue is"
#: Growth of the error on held-out data with all that was added from which on it is worse than nothing, and the words.
WORSE = 0.05
FAILS = "significant, but beside what else was found it makes held-out data worse than they are with nothing added"
#: Why a law of the rate has no name that was added more than once.
REPEATED = "it was added more than once: together they follow a curve of the rate that no effect names"


def settled(track: Track, alpha: float, seed: int, progress: Progress) -> Track:
    """Swap each added effect for a better one where there is one, then list what cannot be told from it."""
    for _ in range(2):
        rivalries = [_rivals_of(track, step, alpha, seed, progress) for step in track.steps]
        swaps = [(s, r.better) for s, r in zip(track.steps, rivalries, strict=True) if r.better is not None]
        track = replace(track, rivalries=tuple(rivalries))
        if not swaps:
            break
        step, better = swaps[0]
        assert better is not None
        if (swapped := _swapped(track, step, better, alpha)) is track:
            break  # its rivals would be the same again
        track = swapped
    return track


def sized(track: Track) -> Track:
    """The track without effects whose size is not told, by deviations that hold shapes which are right only nearly."""
    while True:
        added = tuple(step.hit.term for step in track.steps)
        alone = (step for step in track.steps if not step.together)  # of the others each target tells a part
        weak = next(
            (
                (s, why)
                for s in alone
                if (why := unsized(track.problem, track.fit, s.hit.term, added, s.hit.held_out, s.hit.looks))
            ),
            None,
        )
        if weak is None:
            return track
        step, why = weak
        track = dropped(track, step, why)


def without_repeated(track: Track) -> Track:
    """The track without laws of the rate that were added more than once, for neither of them has its form.

    In 350 simulated tables it was a ripple of the compensation but once, beside a rate that a drive had filtered, and
    there was none. What has no shape to be wrong, as a lock-in so large that its law is another one, is left to stand.
    """
    for step in track.steps:
        effect = step.hit.candidate.effect
        if effect.shapes and effect.of_rate and not effect.generic and times(track, effect.key) > 1:
            for one in (s for s in track.steps if s.hit.candidate.effect.key == effect.key):
                track = dropped(track, one, REPEATED)
    return track


def without_worse(track: Track) -> Track:
    """The track without those of its effects with which held-out data are worse off than with none at all.

    Each was confirmed on the rows that there were then: events that are left out since change what they show.
    """
    while track.steps:
        declared = held_out_score(track.problem, solve(track.problem, track.prepared.model))
        if track.score.rms <= (1 + WORSE) * declared.rms:
            break
        fewer, step = min(
            ((dropped(track, step, ""), step) for step in track.steps), key=lambda each: each[0].score.rms
        )
        refused = Refusal(step.hit, FAILS, fails=not step.together)
        track = replace(fewer, refusals=(*fewer.refusals, refused))
    return track


def times(track: Track, key: str) -> int:
    """How often an effect was added."""
    return sum(step.hit.candidate.effect.key == key for step in track.steps)


def without_parts_of_a_curve(track: Track, alpha: float) -> Track:
    """The track without laws of the rate that are parts of one curve of it, of which they are the best approximations.

    A characteristic with a corner has a cube named, then a ripple of what that leaves. Where several laws of the rate
    were added, or one and a curve without a cause, and none explains anything beside a smooth curve of the rate in the
    place of all, they have no name.
    """
    laws = [s for s in track.steps if _is_curve_of_rate(s)]
    curve = next((c for c in track.candidates if c.generic and c.effect.of_rate), None)
    beside = {t for t in track.fit.model if t.effect.generic and t.effect.of_rate}
    if not laws or len(laws) + len(beside) < SEVERAL or curve is None:
        return track
    gone = {s.hit.term for s in laws} | beside
    rest = tuple(term for term in track.fit.model if term not in gone)
    fit = solve(track.problem, rest, start=track.fit.noise.power)
    base = reference(track.problem, rest, fit.noise.power)
    _, best = max((likelihood_ratio(track.problem, base, (*rest, t))[0], k) for k, t in enumerate(curve.terms))
    fit = solve(track.problem, (*rest, curve.terms[best]), start=fit.noise.power)
    base = reference(track.problem, fit.model, fit.noise.power)
    alone = [at_shape(track.problem, fit, base, step.hit, step.hit.term) for step in laws]
    if any(hit.log_p < math.log(alpha) for hit in alone):
        return track
    for step in (*laws, *(s for s in track.steps if s.hit.term in beside)):
        track = dropped(track, step, "" if step.hit.candidate.generic else OF_A_CURVE)
    return track


def _is_curve_of_rate(step: Step) -> bool:
    """Whether a step added a law of the present rate that has a name; a response and a gain are certain otherwise."""
    effect = step.hit.candidate.effect
    remembers = isinstance(effect, MemoryEffect)
    return effect.of_rate and not (effect.generic or effect.of_response or remembers or effect.part == "gain")


def parted(tracks: list[Track]) -> list[Track]:
    """The tracks without a cause of several targets of which, beside what was added later, one shows nothing any more.

    There it is refused; the others are asked again without that one, for its evidence was a part of theirs.
    """
    for track in tracks:
        for step in track.steps:
            if step.together and (why := _no_part(track, step)):
                return [_without_joint(one, step, why if one is track else "") for one in tracks]
    return tracks


def _no_part(track: Track, step: Step) -> str:
    """Why a target has no part in a cause of several: neither a size nor evidence of its own; empty if it has.

    A size may be uncertain because the noise is: a drift beside a walk, which the held-out rows tell from it.
    """
    size = own_size(track.problem, track.fit, step.hit.term)
    if size >= DOUBT:
        return ""
    fit = _without(track, step)
    base = reference(track.problem, fit.model, track.fit.noise.power)
    if at_shape(track.problem, fit, base, step.hit, step.hit.term).deviate >= DOUBT:
        return ""
    return f"beside what was added after it, its size here is {size:.2g} standard deviations from nothing"


def _without(track: Track, step: Step) -> Fit:
    rest = tuple(term for term in track.fit.model if term is not step.hit.term)
    return solve(track.problem, rest, start=track.fit.noise.power)


def _without_joint(track: Track, joint: Step, why: str) -> Track:
    """The track without its part of a cause of several targets, refused if there is a reason ``why``."""
    key = joint.hit.candidate.effect.key
    part = next((s for s in track.steps if s.together == joint.together and s.hit.candidate.effect.key == key), None)
    if part is None:
        return track
    return dropped(track, part, why)


def dropped(track: Track, step: Step, why: str) -> Track:
    """The track without what a step added, its size refused if there is a reason ``why``."""
    fit = _without(track, step)
    refusals = (*track.refusals, Refusal(step.hit, why, unsized=True)) if why else track.refusals
    stay = [s is not step for s in track.steps]
    steps = tuple(s for s, stays in zip(track.steps, stay, strict=True) if stays)
    rivalries = tuple(r for r, stays in zip(track.rivalries, stay, strict=False) if stays)  # none within the search
    score = held_out_score(track.problem, fit)
    return replace(track, fit=fit, score=score, steps=steps, rivalries=rivalries, refusals=refusals, hits=None)


def _rivals_of(track: Track, step: Step, alpha: float, seed: int, progress: Progress) -> Rivalry:
    if step.hit.candidate.generic:
        return Rivalry((), None)
    progress(f"{track.problem.target}: what else would explain {step.hit.candidate.effect.key}")
    curves = {s.hit.term for s in track.steps if s.hit.candidate.generic}
    others = tuple(t for t in track.fit.model if t is not step.hit.term and t not in curves)
    fit = solve(track.problem, others, start=track.fit.noise.power)
    able = (*track.candidates, *(track.local if step.hit.candidate.effect.of_rate else ()))
    tried = tuple(c for c in able if not c.generic and c.effect.key not in _keys(others))
    hits = search(track.problem, fit, tried, seed, track.family, track.tones)
    if not step.together and 0 < step.p_value < step.hit.p_value:  # as it was judged by fewer looks, so are they
        hits = [replace(hit, looks=hit.looks * step.p_value / step.hit.p_value) for hit in hits]
    return rivalry(track.problem, others, step.hit.term, hits, alpha, _gain(track))


def _gain(track: Track) -> float:
    """What each further parameter of a rival must gain.

    Nothing where more noise would do, or where the Earth rate takes up the levels of the rests: an effect that has the
    added one as its limit, as a warm-up has a drift, is then a rival too, for nobody knows the end.
    """
    rests = all(e.motion.projection == 0 for e in track.problem.exposures)
    free = rests and any(t.effect.of_earth for t in track.fit.model)
    return 0.0 if free or track.instead else RICHER_GAIN


def _keys(model: Model) -> set[str]:
    return {term.effect.key for term in model}


def _swapped(track: Track, step: Step, better: Hit, alpha: float) -> Track:
    """The track with ``better`` in the place of ``step``, if it is significant by itself and held-out data agree.

    Of a law of the temperature itself they agree up to what chance does: which of two is named first is not theirs.

    What several axes show together may be a little better explained on one of them by an event: that is no evidence.
    """
    if not better.log_p < math.log(alpha):
        return track
    model = tuple(better.term if t is step.hit.term else t for t in track.fit.model)
    fit = solve(track.problem, model, start=track.fit.noise.power)
    score = held_out_score(track.problem, fit)
    chance = CHANCE if is_plain(better.term.effect) else 0.0
    if score.rms > track.score.rms * (1 + chance) or unsized(
        track.problem, fit, better.term, held_out=better.held_out, looks=better.looks
    ):
        return track
    steps = tuple(Step(better, s.before, score, better.p_value) if s is step else s for s in track.steps)
    return replace(track, fit=fit, score=score, steps=steps)
