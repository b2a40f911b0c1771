"""A slow cause at rest by all rows, the held-out ones too, where fitted and held-out ones apart do not decide.

Of a short record the fitted part tells the noise's walk from a few slow modes, and what is over by its end the held-out
part cannot confirm: a base that settles for 15 s in the first of 40 s is a random walk as well as not. That the level
then stands still for as long again is what says that it was none. So, where nothing was found, each of the k slow
causes is asked of all rows as well, the noise fitted to all of them, by its likelihood ratio and the looks of its own
shapes:

    p = k min_i p_i,        i = a drift, a warm-up, what the temperature does.

Nothing is found by this, for no row is left that could refuse it: what is significant is a doubt, and may be named with
the noise that would do as well (`insenv.identify.search.undecided`).

Of a unit that turns beside a reference the same is asked of its bias, once what else it has was added: a minute of a
robot that is driven tells a drift by its last third as well, which is held out. What errors of the reference follow of
it counts as little as in the search (`insenv.identify.search.artefacts.reference_errors`). And, where a table stands
now and then, of these rests alone: it is louder where it turns, by its own wow, and noise that is alike everywhere
hides there what two rests tell at a glance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.series.stretches import stretches
from insenv.effects.base import Effect
from insenv.identify.fit.bins import of_one_use
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import NOISE_TERMS, Model, Problem
from insenv.identify.prepare.vibration import averaged
from insenv.identify.search.artefacts.levels_of_runs import not_told_by_levels
from insenv.identify.search.artefacts.reference_errors import beside_reference_errors
from insenv.identify.search.candidates import Candidate, candidates
from insenv.identify.search.jumps import is_step
from insenv.identify.search.round import by_fit_alone
from insenv.identify.search.scan import Hit, largest_statistic, reference
from insenv.identify.search.staying import WANDERING
from insenv.identify.search.tracks import Track
from insenv.identify.search.unit.one_box import DRIFTS, is_thermal, log_p_by_itself

#: Score statistic from which a cause beside a reference is worth two fits of noise; to be said, it must be certain with
#: 1e-3 among all shapes and causes, which takes a likelihood ratio of 13 and more.
SEEN = 9.0
#: Fewest means that are left of those that are merged two by two: four kinds of noise and a law want as many.
FEWEST_LONG = 50
#: Share of the largest rate up to which a table stands, fewest means of a rest, and fewest rests.
STANDS, FEWEST_MEANS, FEWEST_RESTS = 1e-3, 10, 2
#: Means at the ends of a rest that may hold motion, beside a tenth of it at its start.
EDGE = 2


@dataclass(frozen=True)
class AllRows:
    """All rows of each run as one stretch, the model without slow causes fitted to them, and these added to it.

    ``steps`` are the steps of the bias, which are no law; ``laws`` are the others.
    """

    problem: Problem
    fit: Fit
    laws: tuple[Hit, ...]
    steps: tuple[Hit, ...]


def of_all_rows(track: Track, seed: int = 0) -> AllRows | None:
    """Slow causes by all rows of a unit at rest; None where none is tried. Curves without a cause are left out.

    Parameters
    ----------
    track : Track
    seed : int
        Of the simulated noise.
    """
    tried = tuple(c for c in track.candidates if may_move_bias(c.effect))
    if track.problem.turns or all(is_step(c.effect) for c in tried):
        return None
    return _asked(track, whole_of(track), track.fit.named, tried, seed)


def of_all_rows_beside_a_reference(track: Track, seed: int = 0) -> AllRows | None:
    """Slow causes of the bias by all rows of a unit that turns, beside all that was added; None where none is seen.

    A step that several instants were tried for is one of the laws here, for nothing is named by this.

    Parameters
    ----------
    track : Track
    seed : int
        Of the simulated noise.
    """
    return _beside(track, whole_of(track), seed) if track.problem.turns else None


def of_longer_means(track: Track, seed: int = 0) -> AllRows | None:
    """The same by all rows in means so long that there is noise of slow modes alone; None where these are as long.

    Of one run alone: of several the search asks whether a law comes again, and each of them would have few such means.
    Nor where held-out rows are far louder than fitted ones: so few means tell no noise that is not alike in both.

    Parameters
    ----------
    track : Track
    seed : int
        Of the simulated noise.
    """
    if not track.problem.turns or len(track.problem.exposures) > 1 or track.score.unforetold:
        return None
    longer = longer_means(track)
    return None if longer is None else _beside(track, longer, seed)


def longer_means(track: Track, fewest: int = FEWEST_LONG) -> Problem | None:
    """All rows of a track in so few means that noise of slow modes alone is fitted; None where there are no more."""
    whole = whole_of(track)
    times = int(math.log2(max(whole.bins.n / fewest, 1.0)))
    if not times:
        return None
    merged: Problem = track.problem.remember(("longer means", times), lambda: averaged(whole, times))
    return merged if merged.bins.n >= fewest // 2 else None


def _beside(track: Track, whole: Problem, seed: int) -> AllRows | None:
    """Slow causes of the bias by all rows of a problem beside what was added; None where none is seen."""
    tried = tuple(at_all_times(whole, c) for c in track.candidates if is_of_bias(c.effect))
    if not tried or _unseen(track, whole, tried):
        return None
    rows = _asked(track, whole, track.fit.model, tried, seed)

    def beside() -> AllRows:
        base = reference(rows.problem, rows.fit.model, rows.fit.noise.power)
        hits = (*rows.laws, *rows.steps)
        alone = [beside_reference_errors(rows.problem, rows.fit, base, replace(hit, looks=1.0)) for hit in hits]
        laws = tuple(replace(one, looks=hit.looks) for one, hit in zip(alone, hits, strict=True))
        return AllRows(rows.problem, rows.fit, laws, ())

    found: AllRows = whole.remember(("all rows beside a reference", rows.fit.model, seed), beside)
    return found


def of_rests(track: Track, seed: int = 0) -> AllRows | None:
    """Slow causes of the bias by the rests of a table alone, where it stands more than once; None where it does not.

    Parameters
    ----------
    track : Track
    seed : int
        Of the simulated noise.
    """
    whole = whole_of(track)
    u = np.abs(whole.bins.mean(tuple(e.u for e in whole.exposures)))
    tried = tuple(c for c in track.candidates if is_of_bias(c.effect))
    rests = [
        (a + EDGE + (b - a) // 10, b - EDGE)  # what lags behind the motion still comes to rest there
        for run in range(len(whole.exposures))
        for a, b in stretches((u <= STANDS * u.max()) & (whole.bins.run == run))
        if b - a >= FEWEST_MEANS + 2 * EDGE
    ]
    if not track.problem.turns or not tried or len(rests) < FEWEST_RESTS:
        return None
    gone = np.ones(whole.bins.n, bool)
    for a, b in rests:
        gone[a:b] = False
    still = whole.without_bins(gone)
    fit = solve(still, tuple(term for term in track.fit.model if _moves_a_rest(term.effect)))
    base = reference(still, fit.model, fit.noise.power)
    return AllRows(still, fit, tuple(by_fit_alone(still, fit, base, tried, seed, track.family, tones=False)), ())


def _moves_a_rest(effect: Effect) -> bool:
    """Whether an effect is a level, or moves it where a table stands."""
    return effect.part == "level" or (may_move_bias(effect) and not effect.of_rate)


def is_of_bias(effect: Effect) -> bool:
    """Whether an effect is a slow change of the bias, a step of it, or goes with the temperature of the moment.

    In proportion: what remembers the temperature has shapes, and what bends with it orders, of which one is like any
    slow noise.
    """
    thermal = is_thermal(effect) and len(effect.params) == 1 and not effect.of_rate
    return effect.key in DRIFTS or is_step(effect) or thermal


def may_move_bias(effect: Effect) -> bool:
    """Whether an effect is such a one, or anything else that a temperature does."""
    return is_of_bias(effect) or is_thermal(effect)


def at_all_times(whole: Problem, one: Candidate) -> Candidate:
    """A step at any instant of all rows, of which the search tries those of the fitted ones; else as it is."""
    if not is_step(one.effect):
        return one
    found, _ = candidates(whole, (one.effect,))
    return found[0] if found else one


def _unseen(track: Track, whole: Problem, tried: tuple[Candidate, ...]) -> bool:
    """Whether no cause stands out of noise that does not wander, of all noise the one that hides least of it.

    Nothing else is asked then: most recordings are spared two fits of noise for each cause. Remembered, as it is asked
    for each word that is said of what is slow.
    """

    def unseen() -> bool:
        most = np.where([term.id in WANDERING for term in NOISE_TERMS], 0.0, np.inf)
        most = most if whole.most is None else np.minimum(most, whole.most)
        base = reference(replace(whole, most=most), track.fit.model, track.fit.noise.power)
        return largest_statistic(whole, base, tried) < SEEN

    causes = tuple((one.effect.key, one.terms) for one in tried)
    known: bool = whole.remember(("unseen", track.fit.model, track.fit.noise.power.tobytes(), causes), unseen)
    return known


def whole_of(track: Track) -> Problem:
    """The problem of a track with all its rows fitted."""

    def rows() -> Problem:
        return track.problem.used_as(of_one_use(track.problem.bins).blocks)

    whole: Problem = track.problem.remember("whole", rows)
    return whole


def _asked(track: Track, whole: Problem, model: Model, tried: tuple[Candidate, ...], seed: int) -> AllRows:
    """Causes by all rows beside a model, without those of which runs tell no more than levels that scatter."""

    def asked() -> AllRows:
        fit = solve(whole, model, start=track.fit.noise.power)
        base = reference(whole, fit.model, fit.noise.power)
        hits = by_fit_alone(whole, fit, base, tried, seed, track.family, tones=False)
        steps = tuple(hit for hit in hits if is_step(hit.candidate.effect))
        laws = (hit for hit in hits if hit not in steps)
        told = tuple(hit for hit in laws if not not_told_by_levels(whole, fit, hit.term))
        return AllRows(whole, fit, told, steps)

    found: AllRows = whole.remember(("all rows", model, seed), asked)
    return found


def surest_slow(track: Track, seed: int = 0) -> tuple[Hit, float] | None:
    """The slow cause that all rows of a unit at rest speak for most, and its p-value; None where none is tried.

    Parameters
    ----------
    track : Track
    seed : int
        Of the simulated noise.
    """
    hits = () if (rows := of_all_rows(track, seed)) is None else rows.laws
    found = min(hits, key=lambda hit: log_p_by_itself(track, hit), default=None)
    return None if found is None else (found, min(1.0, len(hits) * math.exp(log_p_by_itself(track, found))))
