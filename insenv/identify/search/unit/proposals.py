"""What may be added next: the best effect of each target, and causes that several targets have in common.

The deviates d of n targets of one cause at one shape are added,

    z = sum_i d_i / sqrt(n),        p = looks P(Z > z)

(Stouffer). Drifts of one box, its warmth and its lines have rules of their own (`one_box`, `one_line`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.own import ALL
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.prepare.spectral.line_effects import IN_BINS
from insenv.identify.prepare.spectral.lines import Line
from insenv.identify.prepare.spectral.wandering import of_counts, of_the_motion, wanders
from insenv.identify.search.candidates import stacked_terms
from insenv.identify.search.round import at_shape, with_term
from insenv.identify.search.scan import Hit, likelihood_ratio, reference, statistics
from insenv.identify.search.tracks import MOST_ADDED, Track
from insenv.identify.search.unit.one_box import (
    DRIFTS,
    LEAST,
    in_common,
    is_thermal,
    log_p_by_itself,
    looks_of,
    may_drift,
    surest,
    warmed,
)
from insenv.identify.search.unit.one_line import rings_too

#: Effects of one physical cause on several targets: judged on all of them together.
SHARED = tuple(sorted(effect.id for effect in ALL if effect.of_base))

#: Shapes of a cause whose likelihood ratio is taken on all its targets, best sum of scores first: all of a course in
#: time, whose scores the noise has taken in, and some of the instants of a step.
SHAPES_TOGETHER = 10

#: Normal deviate of a target's own from which on it has a cause that all have together, chance in one of a hundred; and
#: of its held-out data, from which on a twentieth will do.
OWN, HELD_OUT = 2.33, 1.0

#: Lines that are damped in the bins of one target at most; beyond them what is left has a cause that is no line.
MOST_DAMPED = 4


@dataclass(frozen=True)
class Proposal:
    """An effect, significant on the targets ``where`` taken together; ``looks`` were taken for all of them at once."""

    where: tuple[int, ...]
    hits: tuple[Hit, ...]
    p_value: float
    looks: float = 0.0

    @property
    def rank(self) -> float:
        """What orders proposals: as that of a hit."""
        if not self.looks:
            return sum(hit.rank for hit in self.hits)
        return sum(hit.likelihood_ratio - 2 * hit.size for hit in self.hits) - 2 * math.log(self.looks)


def proposals(tracks: list[Track], alpha: float) -> list[Proposal]:
    """Significant effects: the best one of each target, and those of one cause on several targets."""
    found: list[Proposal] = []
    for index, track in enumerate(tracks):
        able = () if _full(track) else track.hits or ()
        good = [h for h in able if h.log_p < math.log(alpha) and not _is_shared(h) and not _refused(track, h)]
        # A line whose phase does not hold comes last: what shakes with the base may have a cause.
        good.sort(key=lambda hit: wandering(track, hit) is not None)
        found += [Proposal((index,), (hit,), hit.p_value) for hit in good[:1]]
    found += drifts_of_one_box(tracks, alpha)
    found += [one for index in range(len(tracks)) if (one := _warmed_too(tracks, index, alpha))]
    if not found:
        found += [one for index in range(len(tracks)) if (one := _rung_too(tracks, index, alpha))]
    for key in SHARED:
        where = tuple(i for i, t in enumerate(tracks) if has(t, key) and not _full(t))
        if where:
            hits = tuple(common([tracks[i] for i in where], key))
            log_p = joint_log_p(hits)
            there = [(i, hit) for i, hit in zip(where, hits, strict=True) if _has_a_part(hit)]
            if log_p < math.log(alpha) and there:
                found.append(Proposal(tuple(i for i, _ in there), tuple(hit for _, hit in there), math.exp(log_p)))
    return found


def _warmed_too(tracks: list[Track], index: int, alpha: float) -> Proposal | None:
    """What the temperature does to other axes, where it is significant on this one by itself."""
    track = tracks[index]
    if _full(track) or any(is_thermal(term.effect) for term in track.added) or not warmed(tracks, index):
        return None
    able = [hit for hit in track.hits or () if is_thermal(hit.candidate.effect) and not _refused(track, hit)]
    best = min(able, key=lambda hit: log_p_by_itself(track, hit), default=None)
    if best is None or (log_p := log_p_by_itself(track, best)) >= math.log(alpha):
        return None
    return Proposal((index,), (best,), math.exp(log_p))


def _rung_too(tracks: list[Track], index: int, alpha: float) -> Proposal | None:
    """A line that other channels of a unit at rest have, where it is significant on this one at that frequency."""
    if _full(tracks[index]):
        return None
    hit = rings_too(tracks, index)
    if hit is None or hit.log_p >= math.log(alpha) or _refused(tracks[index], hit):
        return None
    return Proposal((index,), (hit,), hit.p_value)


def drifts_of_one_box(tracks: list[Track], alpha: float, keys: tuple[str, ...] = DRIFTS) -> list[Proposal]:
    """Drifts that are significant on several axes of a unit at rest together, at one shape."""
    found: list[Proposal] = []
    for key in keys:
        able = [i for i, t in enumerate(tracks) if may_drift(t) and has(t, key) and not _full(t)]
        where = [i for i in able if hit_of(tracks[i], key).deviate >= LEAST]
        if len(where) < 2:
            continue
        hits = dict(zip(where, common([tracks[i] for i in where], key), strict=True))
        looks = max(looks_of(tracks[i], hit) for i, hit in hits.items())
        deviates = [(hits[i] if i in hits else hit_of(tracks[i], key)).deviate for i in able]
        log_p = surest(deviates, looks)
        if log_p < math.log(alpha):
            log_p = surest(deviates, looks, _in_common(tracks, able, hits))
        where = [i for i, hit in hits.items() if hit.deviate >= LEAST]
        if log_p < math.log(alpha):
            found.append(Proposal(tuple(where), tuple(hits[i] for i in where), math.exp(log_p), looks))
    return found


def _in_common(tracks: list[Track], able: list[int], hits: dict[int, Hit]) -> Floats:
    """Covariance of the deviates of the channels ``able``, by slow noise that those with ``hits`` have in common."""
    fits = {i: solve(tracks[i].problem, with_term(tracks[i].fit.model, hit.term)) for i, hit in hits.items()}
    out, own = np.eye(len(able)), [able.index(i) for i in hits]
    out[np.ix_(own, own)] = in_common([(tracks[i].problem, fit) for i, fit in fits.items()])
    return out


def wandering(track: Track, hit: Hit) -> Line | None:
    """The line of a tone that is none: its phase does not hold, or it is an encoder's pattern or the motion's."""
    if not hit.candidate.effect.line or not may_damp(track):
        return None
    found: Line | None = track.problem.remember(
        ("wanders", hit.term, track.fit.model),
        lambda: (
            of_counts(track.problem, track.fit, hit.term.shape[0])
            or wanders(track.problem, track.fit, hit.term.shape[0])
            or of_the_motion(track.problem, track.fit, hit.term.shape[0])
        ),
    )
    return found


def may_damp(track: Track) -> bool:
    """Whether one more line may be damped in the bins."""
    damped = sum(line.frequency < IN_BINS / track.problem.bins.width for line in track.prepared.lines)
    return damped < MOST_DAMPED


def _full(track: Track) -> bool:
    return len(track.added) >= MOST_ADDED


def _is_shared(hit: Hit) -> bool:
    return hit.candidate.effect.of_base


def _refused(track: Track, hit: Hit) -> bool:
    return any(r.hit.candidate.effect.key == hit.candidate.effect.key for r in track.refusals)


def has(track: Track, key: str) -> bool:
    """Whether an effect was tried and not refused."""
    return any(h.candidate.effect.key == key and not _refused(track, h) for h in track.hits or ())


def hit_of(track: Track, key: str) -> Hit:
    """The hit of an effect."""
    return next(h for h in track.hits or () if h.candidate.effect.key == key)


def _has_a_part(hit: Hit) -> bool:
    """Whether a target shows by itself something of a cause that is certain on all of them together."""
    return hit.deviate >= OWN or (hit.deviate >= LEAST and hit.held_out >= HELD_OUT)


def joint_log_p(hits: tuple[Hit, ...]) -> float:
    """Significance of one cause on several targets: their deviates added (Stouffer)."""
    total = sum(hit.deviate for hit in hits) / math.sqrt(len(hits))
    return min(0.0, log_tail(total) + math.log(max(hit.looks for hit in hits)))


def common(tracks: list[Track], key: str) -> list[Hit]:
    """The hits of one cause on several targets, at the one shape that explains them best together."""
    hits = [hit_of(track, key) for track in tracks]
    if len(hits) == 1 or not hits[0].candidate.effect.shapes:
        return hits
    bases = [reference(t.problem, t.fit.model, t.fit.noise.power) for t in tracks]

    def total(term: Term) -> float:
        ratios = [
            likelihood_ratio(t.problem, b, with_term(b.model, term))[0] for t, b in zip(tracks, bases, strict=True)
        ]
        return sum(ratios)

    terms = hits[0].candidate.terms
    scores = [statistics(t.problem, b, stacked_terms(t.problem, terms)) for t, b in zip(tracks, bases, strict=True)]
    likely = np.argsort(-np.sum(scores, axis=0), kind="stable")[:SHAPES_TOGETHER]
    term = max((terms[k] for k in likely), key=total)
    return [at_shape(t.problem, t.fit, b, h, term) for t, b, h in zip(tracks, bases, hits, strict=True)]
