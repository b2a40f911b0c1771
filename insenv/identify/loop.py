"""Closing the loop: declared model -> residual -> candidate effect -> joint refit -> held-out error -> verdict.

Each round searches the catalogue on every target, adds the most significant effect that held-out data do not refuse,
refits everything together, and drops what has become superfluous. Effects that are one physical cause on several
targets are judged on all of them together. Generic curves come last, after every physical effect has had its chance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from insenv.core.recording import Recording
from insenv.core.series.allan import WALK
from insenv.data.manifest.spec import Manifest
from insenv.data.reference import with_reference
from insenv.data.split import RowUse
from insenv.effects.base import Effect
from insenv.effects.catalogue import CATALOGUE
from insenv.effects.timing import SampleHold, TimingSkew
from insenv.effects.tone import Tone
from insenv.identify.clean.holds import Hold, Look
from insenv.identify.clean.settling import settled_by, without_start
from insenv.identify.clean.unreached import rows_of, unreached
from insenv.identify.findings import NotTestable
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import CHANCE, MOST_GROWTH, confirms, held_out_score, rescored
from insenv.identify.fit.lag_form import is_skew
from insenv.identify.fit.problem import NOISE_TERMS
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.prepare.excess import most_power, order_of_line, structure
from insenv.identify.prepare.problems import prepare
from insenv.identify.prepare.spectral.lines import Line
from insenv.identify.prepare.spectral.wandering import (
    goes_with_motion,
    left_of,
    lost,
    moves_there,
    stands_in_reference,
    stops_at_rest,
    without_line,
)
from insenv.identify.prepare.vibration import (
    affordable,
    as_lines,
    averaged,
    doublings,
    is_folded,
    loudest,
    stands_out,
    unnamed,
    unresolved,
    without,
)
from insenv.identify.search.candidates import candidates, local_beside_lag, of_few_waves
from insenv.identify.search.earth_rate import due_level
from insenv.identify.search.jumps import is_step, one_of_many
from insenv.identify.search.round import at_shape, search, with_term
from insenv.identify.search.scan import Hit, Reference, likelihood_ratio, reference
from insenv.identify.search.settle import parted, settled, sized, without_parts_of_a_curve, without_repeated
from insenv.identify.search.size import follows_measured_rate, unsized, unsized_together
from insenv.identify.search.tracks import Progress, Refusal, Step, Track
from insenv.identify.search.undecided import with_sets
from insenv.identify.search.unit.one_box import (
    DOUBT,
    LEAST,
    STEPS,
    may_drift,
)
from insenv.identify.search.unit.other_gyros import beside_other_gyros
from insenv.identify.search.unit.proposals import (
    SHARED,
    Proposal,
    common,
    drifts_of_one_box,
    has,
    hit_of,
    joint_log_p,
    may_damp,
    proposals,
    wandering,
)

#: Least normal deviate of a target's own evidence for a cause that was found on several targets together.
LEAST_SUPPORT = 1.0

#: Fits at most in which an effect that is linear only for small parameters comes to those that it has.
MOST_PASSES = 6

#: Log likelihood ratio by which an effect that is exact at its size may explain less than one that is for small ones:
#: at one frequency they are one curve and differ in the gain.
AS_LIKELY = 2.0
#: Forms that are tried, and the largest that a lag has: that of a first-order one. Beyond it something else is there.
FORMS, LARGEST_FORM = (-0.6, 0.6), 0.55

#: Share by which bins of two targets may differ in length and be as good as one.
SAME = 1e-6

#: Log likelihood ratio by which what an effect has taken the place of must explain more to stay, as the best of rivals.
MARGIN = 6.0

#: Why an effect is refused that would take the place of one which explains more.
LESS = "it would take the place of what explains more"

#: Why a line is refused that is none of the target.
OF_REFERENCE = "it stands in the reference and not in what is read: the reference's own, as an encoder's steps are"

OF_COUNTS = "a line of the counts was taken out there, of which some is left"
#: Why a line beside one that was damped is not named again.
OF_DAMPED = "a line whose phase does not hold was damped there, of which some is left"

#: Why a line is refused that comes so many times a turn of the table.
OF_TURNS = "it comes {} a turn of the table, as what goes with its angle does: a motor's poles, a gear, an encoder"

OF_MOTION = "the motion has a line there as well, of which a filter or a lag leaves some: a motor's ripple, for one"

#: Why a line is refused that the table has while it turns alone.
OF_RIPPLE = "it is there while the table turns and not while it rests: the ripple of a motor, for one"

#: Why a line is refused that another gyro of the unit reads.
OF_TURN = "the unit turns there, as its other gyros read"

#: Why what is asked of one target alone is not tried of several.
OF_ONE = "of several axes a lag that they have together comes first: it is asked of one target alone"

#: Why no hold is tried of means that were made of uneven rows.
OF_MEANS = "rows of uneven steps were made means: an output that is held for less is only late there"

#: P-value below which what is left is suspected to be more than the declared noise.
SUSPECTED = 0.1


@dataclass(frozen=True)
class Outcome:
    """The end of the search: one track per target."""

    tracks: tuple[Track, ...]
    alpha: float
    seed: int


def trace(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    catalogue: tuple[Effect, ...] = CATALOGUE,
    alpha: float = 0.01,
    seed: int = 0,
    progress: Progress = lambda text: None,
) -> Outcome:
    """Trace the residual of the declared model to the effects that it lacks.

    Parameters
    ----------
    manifest : Manifest
    recordings : tuple of Recording
        One per run.
    uses : tuple of RowUse
        Which rows of each run are fitted and which are held out.
    catalogue : tuple of Effect
        Effects that may be added.
    alpha : float
        Probability of adding anything to a target whose declared model is complete.
    seed : int
        Of the simulated noise that calibrates the search.
    progress : callable
        Told what is being done.
    """
    recordings = tuple(with_reference(recording) for recording in recordings)
    begin = partial(_begin, manifest, recordings, uses, catalogue)
    tracks = []
    for target in manifest.model.targets:
        progress(f"{target}: declared model")
        tracks.append(begin(target))
    # The axes of a unit are compared with each other: one averaging for all of them.
    width = max(track.problem.bins.width for track in tracks)
    tracks = [t if width < (1 + SAME) * t.problem.bins.width else begin(t.problem.target, width=width) for t in tracks]
    found = partial(_found, manifest, alpha=alpha, seed=seed, progress=progress)
    tracks = found(tracks)
    if manifest.held_out.averaging is None:
        tried = [tuple(c.effect for c in track.candidates if not c.generic) for track in tracks]
        times = max(doublings(t.problem, t.fit, effects) for t, effects in zip(tracks, tried, strict=True))
        times = min(affordable(t.problem, t.prepared.model, times) for t in tracks)
        if times:
            width *= 2**times
            progress(f"means over {width:.3g} s: shorter ones hold vibration")
            gone = [_gone(track, width) for track in tracks]
            tracks = found([_averaged(track, times) for track in tracks])
            tracks = [replace(t, refusals=(*t.refusals, *lines)) for t, lines in zip(tracks, gone, strict=True)]
    for index, track in enumerate(tracks):
        if _worse(track):
            progress(f"{track.problem.target}: held-out data are worse without its lines and its hold")
            plain = found([begin(track.problem.target, width=width, samples=False)])
            tracks[index] = _with_told(_with_shown(plain[0], track.prepared.held.hold), track, width)
    if not any(manifest.noise.get(track.problem.target) for track in tracks):
        tracks = with_sets(tracks, alpha)
    return Outcome(tuple(tracks), alpha, seed)


def _found(manifest: Manifest, tracks: list[Track], alpha: float, seed: int, progress: Progress) -> list[Track]:
    """The tracks with all that was found, each effect tried against all others in its place."""
    for generic in (False, True):
        tracks = _exhausted(tracks, generic, alpha, seed, progress)
        if generic:
            tracks = [_as_one_curve(track, alpha, seed, progress) for track in tracks]
        else:
            noise = [dict(manifest.noise.get(track.problem.target, {})) for track in tracks]
            tracks = [_strict(track, n, alpha, seed, progress) for track, n in zip(tracks, noise, strict=True)]
            tracks = [replace(track, hits=None, last_physical=track.hits or ()) for track in tracks]
    return [settled(track, alpha, seed, progress) for track in tracks]


def _as_one_curve(track: Track, alpha: float, seed: int, progress: Progress) -> Track:
    """The track with a curve of the rate in the place of laws that are parts of it, where it is found as one.

    What was added twice has no name in any case.
    """
    once = without_repeated(track)
    fewer = without_parts_of_a_curve(once, alpha)
    if fewer is track:
        return track
    (found,) = _exhausted([fewer], True, alpha, seed, progress)
    curves = any(s.hit.candidate.generic and s.hit.candidate.effect.of_rate for s in found.steps)
    return found if curves or fewer is once else once


def _averaged(track: Track, times: int) -> Track:
    """The track on means merged two by two so many times; lines that they do not resolve are taken out before.

    A peak of the hump itself, which no longer stands out of the noise beside it, is no line.
    """
    problem, prepared = track.problem, track.prepared
    width = 2**times * problem.bins.width
    gone = [step for step in track.steps if unresolved(step.hit.term, width)]
    told = estimates(problem, track.fit) if gone else {}
    lines = list(prepared.lines)
    named = [step for step in gone if stands_out(problem, track.fit, step.hit.term)]
    for step in named:
        sd = max(row.sd for row in told[step.hit.term] if row.parameter == "f")
        lines += as_lines(problem, track.fit, step.hit.term, sd, step.p_value)
    known = (*(line.frequency for line in lines), *(s.hit.term.shape[0] for s in track.steps if s.hit.term.effect.line))
    lines += unnamed(problem, prepared.fast(width), known)
    # Of all else the longer means are asked anew: beside a hump the noise, and so every significance, was wrong.
    steps = tuple(s for s in track.steps if s not in gone and isinstance(s.hit.candidate.effect, Tone))
    longer = averaged(without(problem, track.fit, tuple(step.hit.term for step in named)), times)
    plain = averaged(prepared.plain, times)
    model = (*prepared.model, *(term for term in track.added if any(s.hit.term is term for s in steps)))
    fit = solve(longer, model)
    prepared = replace(prepared, problem=longer, plain=plain, lines=tuple(lines))
    return replace(
        track,
        prepared=prepared,
        fit=fit,
        score=held_out_score(longer, fit),
        steps=steps,
        refusals=(),
        hits=None,
        last_physical=(),
        rivalries=(),
        finer=problem.bins.width,
        folded=tuple(refusal.hit.term.shape[0] for refusal in _gone(track, width)),
        loudest=loudest(problem, track.fit, width),
    )


def _gone(track: Track, width: float) -> tuple[Refusal, ...]:
    """Lines that held-out data refused, of which means over ``width`` know nothing."""
    lines = (r for r in track.refusals if r.fails and r.hit.candidate.effect.line)
    return tuple(r for r in lines if unresolved(r.hit.term, width))


def _worse(track: Track) -> bool:
    """Whether what was taken out of the samples, a hold or lines, leaves held-out data worse off than nothing added."""
    plain = track.prepared.plain
    hold = track.prepared.held.hold
    if (hold is None or not hold.taken) and not track.prepared.lines:
        return False
    before = held_out_score(plain, solve(plain, track.prepared.model))
    return track.score.rms > (1 + MOST_GROWTH) * before.rms


def _with_shown(track: Track, hold: Hold | None) -> Track:
    """The track with a hold that the readings show by themselves, which is there though taking it out does not help."""
    if hold is None or not hold.whole or any(_is_of(step.hit, SampleHold.id) for step in track.steps):
        return track
    return replace(track, prepared=replace(track.prepared, held=Look(replace(hold, taken=False))))


def _with_told(track: Track, other: Track, width: float) -> Track:
    """The track with lines of a rest that the ``other`` found and held-out samples confirm, whose means gain nothing.

    Means that reject a line that wanders are noisier than plain ones, which hold little of it: it is there though.
    """
    if track.problem.turns:
        return track
    known = tuple(step.hit.term.shape[0] for step in track.steps if step.hit.term.effect.line)
    told = tuple(line for line in other.prepared.fast(width) if line.own)
    return replace(track, prepared=replace(track.prepared, lines=unnamed(track.problem, told, known)))


def _exhausted(tracks: list[Track], generic: bool, alpha: float, seed: int, progress: Progress) -> list[Track]:
    """Search and add until nothing is left to add."""
    while True:
        tracks = [_searched(track, generic, seed, progress) for track in tracks]
        tracks, grown = _grow(tracks, alpha, progress)
        if not grown:
            tracks, before = tracks if generic else parted([sized(track) for track in tracks]), tracks
            if all(new is old for new, old in zip(tracks, before, strict=True)):
                return tracks


def _strict(track: Track, declared: dict[str, float], alpha: float, seed: int, progress: Progress) -> Track:
    """The search once more with the noise held to what was declared, where nothing was found and it exceeds that.

    Noise that is fitted freely takes in a slow effect of a short recording. What is found against the maker's figures
    is kept if with it they suffice; noise that was not declared stays its rival.
    """
    if track.steps or not declared or structure(track.problem, track.fit, declared, alpha).p_value > SUSPECTED:
        return track
    bound, before = most_power(declared), track.problem.most
    problem = replace(track.problem, most=bound if before is None else np.minimum(bound, before))
    assert problem.most is not None
    fit = solve(problem, track.fit.model)
    held = replace(track.prepared, problem=problem)
    score = held_out_score(problem, fit)
    more = tuple(t.id for t, p, m in zip(NOISE_TERMS, track.fit.noise.power, problem.most, strict=True) if p > m)
    instead = more or (WALK,)
    start = replace(track, prepared=held, fit=fit, score=score, hits=None, refusals=(), instead=instead)
    (found,) = _exhausted([start], False, alpha, seed, progress)
    # Rows may have been left out since, as settling at the start: the fit is that of what is left.
    if not found.steps or structure(found.problem, found.fit, declared, alpha).reasons:
        return track
    return found


def _begin(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    catalogue: tuple[Effect, ...],
    target: str,
    width: float = 0.0,
    samples: bool = True,
) -> Track:
    """A target before its search; bins of ``width`` at least, lines and holds found in the ``samples`` taken out."""
    tones = any(effect.line for effect in catalogue)
    made = any(recording.period is not None for recording in recordings)
    holds = not made and any(effect.id == SampleHold.id for effect in catalogue)
    prepared = prepare(manifest, recordings, uses, target, tones and samples, holds and samples, width)
    found, blind = candidates(prepared.problem, catalogue)
    if len(manifest.model.targets) > 1:
        blind = (*blind, *(NotTestable(c.effect.key, (), OF_ONE) for c in found if c.effect.of_one))
        found = tuple(c for c in found if not c.effect.of_one)
    declared = {term.effect.key for term in prepared.model}
    if prepared.held.hold is not None or prepared.held.excluded:  # the samples told: means tell less of it
        declared = declared | {SampleHold.id}
    if made:
        blind = (*blind, *(NotTestable(c.effect.key, (), OF_MEANS) for c in found if c.effect.id == SampleHold.id))
        declared = declared | {SampleHold.id}
    found = tuple(c for c in found if c.effect.key not in declared)
    fit = solve(prepared.problem, prepared.model)
    score = held_out_score(prepared.problem, fit)
    level = due_level(recordings) if any(t.effect.of_earth for t in prepared.model) else None
    once = len({recording.mounting for recording in recordings}) == 1
    few, local = of_few_waves(prepared.problem, catalogue), local_beside_lag(prepared.problem, catalogue)
    state = (prepared, found, blind, fit, score, tones)
    return Track(*state, level=level, one_mounting=once, few_waves=few, local=local)


def _searched(track: Track, generic: bool, seed: int, progress: Progress) -> Track:
    """The track with its hits on the model as it stands."""
    if track.hits is not None:
        return track
    model, count = len(track.fit.model), len(track.candidates)
    progress(f"{track.problem.target}: testing {count} candidate effects (the model has {model})")
    # What is exact at the size found has a remainder there, as the effect near zero sees it.
    centred = {t.effect.key for t in track.added if t.effect.near(np.zeros(len(t.effect.params))) != t.effect}
    tried = tuple(c for c in track.candidates if c.generic == generic and c.effect.key not in centred)
    hits = search(track.problem, track.fit, tried, seed, track.family, track.tones)
    width = track.problem.bins.width
    return replace(track, hits=tuple(hit for hit in hits if not is_folded(hit.term, track.folded, width)))


def _grow(tracks: list[Track], alpha: float, progress: Progress) -> tuple[list[Track], bool]:
    """Add the most telling of the significant effects that nothing refuses, and whether there was one."""
    while True:
        found = proposals(tracks, alpha)
        if not found:
            return _jumped_together(_failed_together(tracks, alpha), alpha), False
        best = max(found, key=lambda p: p.rank)
        names = tuple(tracks[i].problem.target for i in best.where)
        changed = list(tracks)
        refused = False
        for index, hit in zip(best.where, best.hits, strict=True):
            changed[index], ok = _tried(tracks[index], hit, best, names, alpha)
            refused |= not ok
            progress(f"{tracks[index].problem.target}: {hit.candidate.effect.key} {'added' if ok else 'refused'}")
        if not refused and best.looks and (unclear := _unsized_box(changed, best)):
            refused = True
            for index, hit in zip(best.where, best.hits, strict=True):
                refusal = Refusal(hit, unclear, unsized=True)
                changed[index] = replace(tracks[index], refusals=(*tracks[index].refusals, refusal))
        if not refused:
            return _doubted(changed, best), True
        # A target that refuses has no say any more: the others are asked again without it.
        tracks = [new if new.refusals != old.refusals else old for new, old in zip(changed, tracks, strict=True)]


def _unsized_box(tracks: list[Track], proposal: Proposal) -> str:
    """Why the amounts by which the axes of a box drift, just added, are not told; empty if they are."""
    key = proposal.hits[0].candidate.effect.key
    grown = [tracks[i] for i in proposal.where]
    last = [(t.problem, t.fit, t.steps[-1].hit) for t in grown if t.steps]
    parts = [(problem, fit, hit.term) for problem, fit, hit in last if hit.candidate.effect.key == key]
    return unsized_together(parts) if parts else ""


def _failed_together(tracks: list[Track], alpha: float) -> list[Track]:
    """The tracks with a doubt on each axis of what is significant on all together, and was added to none.

    Each axis may refuse it by its own held-out data; that the axes follow it together is not said to be nothing.
    """
    out = list(tracks)
    for key in SHARED:
        have = [i for i, t in enumerate(tracks) if any(h.candidate.effect.key == key for h in t.hits or ())]
        against = [t.problem.target for t in tracks for r in t.refusals if r.fails_together and _is_of(r.hit, key)]
        if len(have) < 2 or not against or any(_is_of(step.hit, key) for t in tracks for step in t.steps):
            continue
        hits = common([tracks[i] for i in have], key)
        log_p = joint_log_p(tuple(hits))
        if log_p >= math.log(alpha):
            continue
        reason = (
            f"{key} follows them (p = {math.exp(log_p):.1g} on all together), but with it held-out data of "
            f"{', '.join(dict.fromkeys(against))} are worse"
        )
        for i, hit in zip(have, hits, strict=True):
            if hit.deviate >= LEAST:
                others = tuple(r for r in tracks[i].refusals if not _is_of(r.hit, key))
                out[i] = replace(out[i], refusals=(*others, Refusal(hit, reason, of_box=True)))
    return out


def _jumped_together(tracks: list[Track], alpha: float) -> list[Track]:
    """The tracks with a doubt on each axis that changes its level at one instant with others: a knock, or a jump."""
    out = list(tracks)
    for one in drifts_of_one_box(tracks, alpha, STEPS):
        names = ", ".join(tracks[i].problem.target for i in one.where)
        for i, hit in zip(one.where, one.hits, strict=True):
            reason = (
                f"{hit.candidate.effect.key} at {hit.term.shape[0]:.4g} s (p = {one.p_value:.1g} on {names}): not "
                "decided between a base that was moved, a supply, and a jump of the noise"
            )
            out[i] = replace(out[i], refusals=(*out[i].refusals, Refusal(hit, reason, of_box=True)))
    return out


def _is_of(hit: Hit, key: str) -> bool:
    return hit.candidate.effect.key == key


def _doubted(tracks: list[Track], proposal: Proposal) -> list[Track]:
    """The tracks after a drift of the box was added to some: others that may have it are not said to be still."""
    if not proposal.looks:
        return tracks
    key, out = proposal.hits[0].candidate.effect.key, list(tracks)
    for index, track in enumerate(tracks):
        if index in proposal.where or not may_drift(track) or not has(track, key):
            continue
        hit = hit_of(track, key)
        if hit.deviate >= DOUBT:
            out[index] = replace(
                track, refusals=(*track.refusals, Refusal(hit, "too weak on this axis to be told", of_box=True))
            )
    return out


def _tried(track: Track, hit: Hit, proposal: Proposal, names: tuple[str, ...], alpha: float) -> tuple[Track, bool]:
    """The track with ``hit`` added, or with its refusal noted."""
    joined = names if len(names) > 1 else ()
    problem = track.problem
    elsewhere = _left_of(track, hit) or _turns_along(track, hit) or _of_the_reference(track, hit)
    wander = None if elsewhere else wandering(track, hit)
    if wander is not None:
        return _damped(track, wander, hit), True
    if nothing := _nothing(track, hit, joined):
        said = bool(_turns_along(track, hit))
        return replace(track, refusals=(*track.refusals, Refusal(hit, nothing, unsized=said))), False
    if (shorter := _without_ends(track, hit)) is not track:
        return shorter, True
    asked, hit = _as_judged(hit, proposal), _centred(track, hit)
    model = with_term(track.fit.model, hit.term)
    fit = solve(problem, model, start=track.fit.noise.power)
    score = held_out_score(problem, fit)
    confirmed = confirms(track.score, score, rescored(problem, track.fit, fit.noise.power))
    # Each of several effects may cost a little; together no more than one may.
    confirmed &= score.rms <= (1 + MOST_GROWTH) * min(s.rms for s in (track.score, *(s.before for s in track.steps)))
    if follows_measured_rate(problem, hit.term):  # its errors go with the motion; no slow wander excuses a growth
        confirmed &= score.rms <= (1 + CHANCE) * track.score.rms
    if not confirmed and hit.candidate.effect.line and may_damp(track):
        wander = lost(problem, track.fit, hit.term.shape[0])
        if wander is not None:
            return _damped(track, wander, hit), True
    if not confirmed:
        growth = f"by {score.rms / track.score.rms - 1:.0%}" if track.score.rms else "of which nothing was left"
        where = " on several axes together" if proposal.looks else ""
        reason = f"significant{where}, but it makes held-out data worse, {growth}"
        of_box, together = bool(proposal.looks), bool(joined) and not proposal.looks
        against: Refusal | None = Refusal(asked, reason, not joined, of_box=of_box, fails_together=together)
    else:
        unclear = "" if joined else unsized(problem, fit, hit.term, held_out=hit.held_out, looks=hit.looks)
        unclear = unclear or ("" if joined else _no_step(track, fit, hit))
        against = Refusal(hit, unclear, unsized=True) if unclear else None
    if against is not None:
        return replace(track, refusals=(*track.refusals, against)), False
    step = Step(hit, track.score, score, proposal.p_value, joined)
    steps = (*(s for s in track.steps if s.hit.term in model), step)
    grown = replace(track, fit=fit, score=score, steps=steps, hits=None)
    return _kept(track, grown, hit, alpha)


def _as_judged(hit: Hit, proposal: Proposal) -> Hit:
    """The hit with no more looks than its proposal was judged by, if that is of this target alone."""
    if len(proposal.where) > 1 or not 0 < proposal.p_value < hit.p_value:
        return hit
    return replace(hit, looks=math.exp(math.log(proposal.p_value) - log_tail(hit.deviate)))


def _nothing(track: Track, hit: Hit, joined: tuple[str, ...]) -> str:
    """Why a hit is nothing of this target; empty if it may be something."""
    if joined and hit.deviate < LEAST_SUPPORT:
        return "found on another target; nothing speaks for it on this one"
    if not hit.candidate.effect.line:
        return ""
    if damped := _left_of(track, hit):
        return OF_COUNTS if damped.of_counts else OF_MOTION if damped.of_motion else OF_DAMPED
    if order := _turns_along(track, hit):
        return OF_TURNS.format("once" if order == 1 else f"{order} times")
    return OF_REFERENCE if _of_the_reference(track, hit) else _of_the_motion(track, hit)


def _of_the_motion(track: Track, hit: Hit) -> str:
    """Why a line is one of the motion; empty if it is not."""
    problem, fit, frequency = track.problem, track.fit, hit.term.shape[0]
    if (turned := beside_other_gyros(problem, fit)) and not _stands(track, turned, hit):
        return OF_TURN
    if stops_at_rest(problem, fit, frequency):
        return OF_RIPPLE
    moved = moves_there(problem, fit, frequency) or goes_with_motion(problem, fit, frequency)
    return OF_MOTION if moved else ""


def _stands(track: Track, fit: Fit, hit: Hit) -> bool:
    """Whether a hit is more than noise beside the model of ``fit``, another one than that of the track."""
    base = reference(track.problem, fit.model, fit.noise.power)
    return at_shape(track.problem, fit, base, hit, hit.term).log_p < math.log(SUSPECTED)


def _left_of(track: Track, hit: Hit) -> Line | None:
    """The line that was damped in the bins and of which a hit is what is left, if it is."""
    if not hit.candidate.effect.line:
        return None
    return left_of(track.problem, track.prepared.lines, hit.term.shape[0])


def _of_the_reference(track: Track, hit: Hit) -> bool:
    """Whether a hit is a line that stands in the reference alone, whether its phase holds or not."""
    return hit.candidate.effect.line and stands_in_reference(track.problem, track.fit, hit.term.shape[0])


def _turns_along(track: Track, hit: Hit) -> int:
    """Times a turn of the table that the line of a hit comes, if it goes with its angle as nearly as anybody tells."""
    problem, fit = track.problem, track.fit
    if not hit.candidate.effect.line or not problem.turns:
        return 0
    frequency = hit.term.shape[0]
    order: int = problem.remember(("order of", hit.term, fit.model), lambda: order_of_line(problem, fit, frequency))
    return order


def _kept(track: Track, grown: Track, hit: Hit, alpha: float) -> tuple[Track, bool]:
    """The track grown by ``hit`` without what has become superfluous, or with the refusal of what explains less."""
    pruned = _pruned(grown, alpha)
    if _explained_more(track, pruned, hit):
        return replace(track, refusals=(*track.refusals, Refusal(hit, LESS, displaced=True))), False
    return pruned, True


def _explained_more(track: Track, pruned: Track, hit: Hit) -> bool:
    """Whether an effect that ``hit`` has taken the place of explains more than it does, by itself in that place.

    Two curves can contradict each other though each fits: beside a lock-in the rest of a dead band would lose a part
    of the low rates only, which no dead band does. Of the two the likelier stays.
    """
    gone = [s.hit.term for s in track.steps if all(s is not left for left in pruned.steps)]
    if not gone:
        return False
    rest = tuple(t for t in track.fit.model if all(t is not one for one in gone))
    base = reference(track.problem, rest, track.fit.noise.power)
    before, _ = likelihood_ratio(track.problem, base, track.fit.model)
    after, _ = likelihood_ratio(track.problem, base, with_term(rest, hit.term))
    return before - after > MARGIN


def _no_step(track: Track, fit: Fit, hit: Hit) -> str:
    """Why a step, the last term of a fit, is none; empty if it is one or is another effect."""
    if not is_step(hit.candidate.effect):
        return ""
    events = [row.size for row in track.prepared.rejected if row.cause == "burst" and row.size is not None]
    return one_of_many(track.problem, fit, hit.candidate, events)


def _damped(track: Track, wander: Line, hit: Hit) -> Track:
    """The track with a line that wanders taken out of its bins, named among the lines."""
    problem = without_line(track.problem, track.fit, wander)
    line = replace(wander, p_value=hit.p_value)
    prepared = replace(track.prepared, problem=problem, lines=(*track.prepared.lines, line))
    fit = solve(problem, track.fit.model, start=track.fit.noise.power)
    return replace(track, prepared=prepared, fit=fit, score=held_out_score(problem, fit), hits=None)


def _without_ends(track: Track, hit: Hit) -> Track:
    """The track without the start of its run that settled, or ends whose reference was not recorded; itself if none."""
    until = settled_by(track.problem, hit.term)
    if until is not None:
        return _without_start(track, until, hit)
    return _without_unreached(track, hit) if is_skew(hit.term) else track


def _without_start(track: Track, until: float, hit: Hit) -> Track:
    """The track without the start of its run, in which something settled."""
    fit = solve(track.problem, with_term(track.fit.model, hit.term), start=track.fit.noise.power)
    own = fit.theta[fit.design.term == len(fit.model) - 1]
    curve = track.problem.columns(hit.term)[[b.start for b in track.problem.fitted[:1]], 0]
    last = track.problem.columns(hit.term)[track.problem.fitted[-1].stop - 1, 0]
    problem, rows = without_start(track.problem, until, float((curve[0] - last) * own[0]) if len(own) else 0.0)
    # What was taken out of the samples is judged on the same rows as what it was taken out of.
    plain, _ = without_start(track.prepared.plain, until, 0.0)
    prepared = replace(track.prepared, problem=problem, plain=plain, rejected=(*track.prepared.rejected, rows))
    fit = solve(problem, track.fit.model, start=track.fit.noise.power)
    return replace(track, prepared=prepared, fit=fit, score=held_out_score(problem, fit), hits=None)


def _without_unreached(track: Track, hit: Hit) -> Track:
    """The track without means whose reference was not recorded, of a reading that is late or early; itself if none."""
    problem, plain = track.problem, track.prepared.plain
    fit = solve(problem, with_term(track.fit.model, hit.term), start=track.fit.noise.power)
    own = fit.theta[fit.design.term == len(fit.model) - 1]
    if not len(own) or not (gone := unreached(problem, fit, float(own[0]))).any():
        return track
    rows = rows_of(problem, gone, float(own[0]))
    shorter = problem.without_bins(gone)
    also = plain.without_bins(unreached(plain, solve(plain, (*track.prepared.model, hit.term)), float(own[0])))
    prepared = replace(track.prepared, problem=shorter, plain=also, rejected=(*track.prepared.rejected, *rows))
    fit = solve(shorter, track.fit.model, start=track.fit.noise.power)
    return replace(track, prepared=prepared, fit=fit, score=held_out_score(shorter, fit), hits=None)


def _centred(track: Track, hit: Hit) -> Hit:
    """The hit with its effect exact at the size at which it is found, but where that explains less."""
    problem, base = track.problem, reference(track.problem, track.fit.model, track.fit.noise.power)
    for _ in range(MOST_PASSES):
        fit = solve(problem, with_term(track.fit.model, hit.term), start=track.fit.noise.power)
        theta = fit.theta[fit.design.term == len(fit.model) - 1]
        # Of one in every run, the mean: what is left at each is small beside it.
        whole = len(theta) > 0 and len(theta) % len(hit.term.effect.linear) == 0
        mean = theta.reshape(len(hit.term.effect.linear), -1).mean(axis=1) if whole else theta
        # What was read late is the input times the gain.
        mean = mean / (1 + fit.scale_factor) if isinstance(hit.term.effect, TimingSkew) else mean
        effect = hit.term.effect.near(mean) if whole else hit.term.effect
        if effect == hit.term.effect:
            break
        moved = at_shape(problem, track.fit, base, hit, replace(hit.term, effect=effect))
        if moved.likelihood_ratio < hit.likelihood_ratio - AS_LIKELY or moved.remark:
            break
        hit = moved
    return _formed(track, base, hit)


def _formed(track: Track, base: Reference, hit: Hit) -> Hit:
    """The hit of a lag with the form that explains most, where that is beyond doubt no delay."""
    from scipy.optimize import minimize_scalar  # slow to import

    effect = hit.term.effect
    if not isinstance(effect, TimingSkew) or not effect.about:
        return hit

    def of(form: float) -> Hit:
        formed = replace(hit.term, effect=replace(effect, form=float(form)))
        return at_shape(track.problem, track.fit, base, hit, formed)

    best = minimize_scalar(lambda k: -of(k).likelihood_ratio, bounds=FORMS, method="bounded", options={"xatol": 0.01})
    formed = of(best.x)
    better = formed.likelihood_ratio > hit.likelihood_ratio + MARGIN and abs(best.x) < LARGEST_FORM
    return formed if better and not formed.remark else hit


def _pruned(track: Track, alpha: float) -> Track:
    """Drop added effects that the ones added after them have made superfluous."""
    for step in track.steps[:-1]:
        if step.together or (track.steps[-1].hit.candidate.generic and not step.hit.candidate.generic):
            continue  # its evidence lies on other targets too; a curve without a cause displaces no cause
        rest = tuple(t for t in track.fit.model if t is not step.hit.term)
        fit = solve(track.problem, rest, start=track.fit.noise.power)
        base = reference(track.problem, rest, track.fit.noise.power)
        alone = at_shape(track.problem, fit, base, step.hit, step.hit.term)
        if log_tail(alone.deviate) > math.log(alpha):
            steps = tuple(s for s in track.steps if s is not step)
            why = "superfluous beside what was added after it"
            refusals = (*track.refusals, Refusal(step.hit, why, displaced=True))
            score = held_out_score(track.problem, fit)
            track = replace(track, fit=fit, steps=steps, score=score, refusals=refusals)
    return track
