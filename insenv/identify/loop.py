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
from insenv.data.reference import is_in_points, with_reference
from insenv.data.split import RowUse
from insenv.effects.base import Effect
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.effects.timing import SampleHold
from insenv.effects.tone import Tone
from insenv.identify.clean.holds import Hold, Look
from insenv.identify.findings import NotTestable
from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import MOST_GROWTH, held_out_score
from insenv.identify.fit.problem import NOISE_TERMS
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.prepare.excess import most_power, order_left, structure
from insenv.identify.prepare.problems import prepare
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
from insenv.identify.search.beside_a_step import beside_steps
from insenv.identify.search.candidates import candidates, local_beside_lag, of_few_waves
from insenv.identify.search.earth_rate import due_level
from insenv.identify.search.late_thermometer import behind_the_sensor, beside_a_long_lag
from insenv.identify.search.round import search
from insenv.identify.search.scan import Hit
from insenv.identify.search.settle import (
    parted,
    settled,
    sized,
    without_parts_of_a_curve,
    without_repeated,
    without_worse,
)
from insenv.identify.search.size import unsized_together
from insenv.identify.search.staying import WANDERING
from insenv.identify.search.tracks import Progress, Refusal, Track
from insenv.identify.search.undecided import with_sets
from insenv.identify.search.unit.common_wander import with_common_wander
from insenv.identify.search.unit.one_box import (
    DOUBT,
    LEAST,
    STEPS,
    may_drift,
)
from insenv.identify.search.unit.proposals import (
    SHARED,
    Proposal,
    common,
    drifts_of_one_box,
    has,
    hit_of,
    joint_log_p,
    proposals,
)
from insenv.identify.trial import SUSPECTED, times_a_turn, tried

#: Share by which bins of two targets may differ in length and be as good as one.
SAME = 1e-6
#: How often they are made as long as the longest at most: holds of two outputs may have no length in common.
PASSES = 3


#: Why what is asked of one target alone is not tried of several.
OF_ONE = "of several axes a lag that they have together comes first: it is asked of one target alone"

#: Why no hold is tried of means that were made of uneven rows.
OF_MEANS = "rows of uneven steps were made means: an output that is held for less is only late there"


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
    # The axes of a unit are compared with each other: one averaging for all of them, which one may want longer still.
    for _ in range(PASSES):
        width = max(t.problem.bins.width for t in tracks)
        short = [width >= (1 + SAME) * t.problem.bins.width for t in tracks]
        tracks = [begin(t.problem.target, width=width) if s else t for t, s in zip(tracks, short, strict=True)]
        if not any(short):
            break
    width = max(t.problem.bins.width for t in tracks)
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
    return Outcome(tuple(with_common_wander(tracks)), alpha, seed)


def _found(manifest: Manifest, tracks: list[Track], alpha: float, seed: int, progress: Progress) -> list[Track]:
    """The tracks with all that was found, each effect tried against all others in its place."""
    noise = [dict(manifest.noise.get(track.problem.target, {})) for track in tracks]
    for generic in (False, True):
        tracks = _exhausted(tracks, generic, alpha, seed, progress)
        if generic:
            tracks = [_as_one_curve(track, alpha, seed, progress) for track in tracks]
        else:
            further = [_with_orders_left(track, n, alpha) for track, n in zip(tracks, noise, strict=True)]
            if any(new is not old for new, old in zip(further, tracks, strict=True)):
                tracks = _exhausted(further, generic, alpha, seed, progress)
            tracks = [_strict(track, n, alpha, seed, progress) for track, n in zip(tracks, noise, strict=True)]
            tracks = [replace(track, hits=None, last_physical=track.hits or ()) for track in tracks]
    sound = [without_worse(behind_the_sensor(track, alpha)) for track in tracks]
    ended = [settled(track, alpha, seed, progress) for track in sound]
    return [beside_steps(beside_a_long_lag(track)) for track in ended]


def _with_orders_left(track: Track, declared: dict[str, float], alpha: float) -> Track:
    """The track with waves of the table's angle among its candidates that come as often a turn as what is left does.

    So do lines that are none of the time: at one speed what is left follows the time as well. Behind a command they are
    the motor's, for the table turns so.
    """
    waves = [c.effect.id for c in track.candidates if getattr(c.effect, "order", 0) == 1 and "angle" in c.effect.needs]
    if not waves or not track.problem.turns or track.problem.commanded:
        return track
    lines = (times_a_turn(track, r.hit) for r in track.refusals if r.hit.candidate.effect.line)
    orders = {order_left(track.problem, track.fit, declared, alpha), *lines} - {0}
    known = {c.effect.key for c in track.candidates}
    keys = [key for order in sorted(orders) for wave in waves if (key := f"{wave}:{order}") not in known]
    found, _ = candidates(track.problem, tuple(map(by_key, keys)))
    return replace(track, candidates=(*track.candidates, *found), hits=None) if found else track


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
    apart = any(is_in_points(recording) for recording in recordings)
    tones = not apart and any(effect.line for effect in catalogue)
    made = any(recording.period is not None for recording in recordings)
    holds = not made and not apart and any(effect.id == SampleHold.id for effect in catalogue)
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
    labels = tuple(recording.label for recording in recordings)
    wanders = any(manifest.noise.get(target, {}).get(term, 0.0) > 0 for term in WANDERING)
    return Track(*state, level=level, one_mounting=once, labels=labels, few_waves=few, local=local, wanders=wanders)


def _searched(track: Track, generic: bool, seed: int, progress: Progress) -> Track:
    """The track with its hits on the model as it stands."""
    if track.hits is not None:
        return track
    model, count = len(track.fit.model), len(track.candidates)
    progress(f"{track.problem.target}: testing {count} candidate effects (the model has {model})")
    # What is exact at the size found has a remainder there, as the effect near zero sees it.
    centred = {t.effect.key for t in track.added if t.effect.near(np.zeros(len(t.effect.params))) != t.effect}
    bent = any(t.effect.bend for t in track.added)
    able = (c for c in track.candidates if c.generic == generic and not (bent and c.effect.bend))
    tried = tuple(c for c in able if c.effect.key not in centred)
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
            changed[index], ok = tried(tracks[index], hit, best, names, alpha)
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
