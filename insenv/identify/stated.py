"""The estimates that are stated: no surer than parts of the recording, skews, all rows and held-out ones bear them out.

A law of a measured rate whose deviation then holds nothing as well is taken out, and is said: it has no name.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from insenv.effects.timing import TimingSkew
from insenv.identify.clean.doubtful import shortest_agreeing
from insenv.identify.clean.plausibility import CHANGING, FOLLOWS
from insenv.identify.findings import Estimate, WholeError
from insenv.identify.fit.borne_out import borne_out
from insenv.identify.fit.clocks import skew_of_means, skews_apart
from insenv.identify.fit.gls import solve
from insenv.identify.fit.heldout import Score
from insenv.identify.fit.parts import apart as parts_apart
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.uncertainty import SCALE, estimates
from insenv.identify.search.doubts.sizes import nothing_as_well, untold
from insenv.identify.search.settle import dropped
from insenv.identify.search.tracks import Track
from insenv.identify.search.whole.error import by_chance, whole_errors

#: A track, the estimates that are stated, why some are uncertain, and errors of the whole search.
Told = tuple[Track, dict[Term, tuple[Estimate, ...]], tuple[str, ...], list[Callable[[], WholeError | None]]]

#: Departure from one of a gain that a gyro may have, and how many times its scatter the rate is of a table at one rate.
USUAL, ONE_RATE = 0.2, 10.0
#: Chance of so different a gain in the parts of a recording below which it is said.
PARTS_APART = 1e-3


def stated(track: Track) -> tuple[Track, dict[Term, tuple[Estimate, ...]], tuple[str, ...]]:
    """The track without laws that are nothing as well, the estimates that are stated, and why some are uncertain."""
    own, differs = _by_parts(track, _own_estimates(track))
    own, unborne = _by_skews_and_all_rows(track, own)
    own, skewed = _by_shorter_means(track, _by_held_out(track, own))
    own, noisy = _by_the_reference(track, own)
    weak = nothing_as_well(track, own)
    return (track, own, (*differs, *unborne, *skewed, *noisy)) if weak is None else stated(dropped(track, *weak))


def told(track: Track, seed: int) -> Told:
    """The same without what signs by chance give as often too, and of what is left the error of the whole search."""
    found: Told = track.problem.remember_last(("told", seed), track, lambda: _told(track, seed))
    return found


def _told(track: Track, seed: int) -> Told:
    left, own, uncertain = stated(track)
    errors = whole_errors(left, seed)
    gone = by_chance(left, errors)
    return (left, own, uncertain, errors) if gone is None else _told(dropped(left, *gone), seed)


def _own_estimates(track: Track) -> dict[Term, tuple[Estimate, ...]]:
    """Estimates of every term: a curve without a cause has no say in the parameters of those that have one.

    A spline of the rate would take over most of a scale factor. What it explains is noise to the others, which are
    fitted without it.
    """
    problem, fit = track.problem, track.fit
    added = tuple(step.hit.term for step in track.steps)
    named = fit.named
    if len(named) == len(fit.model):
        return estimates(problem, fit, added)
    return estimates(problem, fit) | estimates(problem, solve(problem, named), added)


def _by_parts(
    track: Track, own: dict[Term, tuple[Estimate, ...]]
) -> tuple[dict[Term, tuple[Estimate, ...]], tuple[str, ...]]:
    """The estimates with a scale factor no surer than parts of the recording agree, and a word where they do not."""
    problem = track.problem
    term = next((t for t, rows in own.items() if t.effect.id == SCALE and len(rows) == 1), None)
    if term is None or not problem.turns or not problem.target.startswith("gyro"):
        return own, ()
    named = track.fit.named
    fit = track.fit if len(named) == len(track.fit.model) else solve(problem, named)
    (row,) = own[term]
    found = parts_apart(problem, fit, term)
    if found is None:
        return own, ()
    own = own | {term: (replace(row, sd=math.hypot(row.sd, problem.gain * math.sqrt(found.added))),)}
    if found.chance >= PARTS_APART:
        return own, ()
    gains, deviations = problem.gain * (1 + found.values), abs(problem.gain) * found.deviations
    # To the first digit of the surest: a gain of one that is told to 2e-6 has six decimals.
    places = max(3, math.ceil(-math.log10(max(float(np.min(deviations)), 1e-12))))
    told = ", ".join(f"{g:.{places}f} ± {s:.1g}" for g, s in zip(gains, deviations, strict=True))
    what = "runs" if len(np.unique(problem.bins.run)) > 1 else "quarters of the fitted motion"
    return own, (f"the gain is not the same in the {what}: {told} (p = {found.chance:.1g})",)


def _by_skews_and_all_rows(
    track: Track, own: dict[Term, tuple[Estimate, ...]]
) -> tuple[dict[Term, tuple[Estimate, ...]], tuple[str, ...]]:
    """The estimates no surer than skews and all rows bear them out, and a word on each that one of them does not."""
    own, skewed = _by_skews(track, own)
    borne, unborne = borne_out(track.problem, track.fit, own)
    return borne, (*skewed, *untold(track, own), *unborne)


def unforetold(problem: Problem, score: Score) -> bool:
    """Whether held-out data of a turning unit scatter as no noise of the fitted data does."""
    return problem.turns and score.unforetold


def _by_held_out(track: Track, own: dict[Term, tuple[Estimate, ...]]) -> dict[Term, tuple[Estimate, ...]]:
    """The estimates no surer than held-out data bear the model out: R. T. Birge's factor, Phys. Rev. 40 (1932) 207."""
    if not unforetold(track.problem, track.score):
        return own
    factor = track.score.scatter / track.score.foretold
    return {term: tuple(replace(row, sd=row.sd * factor) for row in rows) for term, rows in own.items()}


def _by_skews(
    track: Track, own: dict[Term, tuple[Estimate, ...]]
) -> tuple[dict[Term, tuple[Estimate, ...]], tuple[str, ...]]:
    """The estimates with a skew no surer than quarters of the recording agree, and a word where they do not."""
    problem = track.problem
    if not problem.turns or not problem.target.startswith("gyro"):
        return own, ()
    found = skews_apart(problem, track.fit)
    if found is None:
        return own, ()
    for term, rows in own.items():
        if isinstance(term.effect, TimingSkew):
            own = own | {term: tuple(replace(row, sd=math.hypot(row.sd, math.sqrt(found.between))) for row in rows)}
    return own, (found.sentence(problem.target),)


def _by_shorter_means(
    track: Track, own: dict[Term, tuple[Estimate, ...]]
) -> tuple[dict[Term, tuple[Estimate, ...]], tuple[str, ...]]:
    """The estimates with a skew no surer than shorter means agree, and a word where they do not.

    Where held-out data have made deviations larger, that is of the same errors: of what is stated then. Shorter means
    of a held output knew nothing of its hold, which is late too.
    """
    said: tuple[str, ...] = ()
    if track.prepared.held.hold is not None:
        return own, said
    for term, rows in own.items():
        if isinstance(term.effect, TimingSkew) and len(rows) == 1:
            added, word = skew_of_means(track.prepared.skews, track.problem.bins.width, rows[0])
            own = own | {term: (replace(rows[0], sd=math.sqrt(rows[0].sd ** 2 + added)),)}
            said = (word,) if word else ()
    return own, said


def _by_the_reference(
    track: Track, own: dict[Term, tuple[Estimate, ...]]
) -> tuple[dict[Term, tuple[Estimate, ...]], tuple[str, ...]]:
    """The estimates with gain and level no surer than noise of a measured reference lets them be, and a word on that.

    Errors of the reference make the gain on it too small, those of the reading that of the reference on the reading:
    the truth lies between (R. Frisch, Statistical confluence analysis, Oslo 1934). Said of a gain that no gyro has,
    where noise is most of either, or where the gain still grew with the length of the longest means.
    """
    problem = track.problem
    term = next((t for t, rows in own.items() if t.effect.id == SCALE and len(rows) == 1), None)
    if term is None or problem.commanded or not problem.turns or not problem.target.startswith("gyro"):
        return own, ()
    (row,) = own[term]
    low, high = _between(problem)
    gains = track.prepared.gains
    grows = len(gains) > 1 and shortest_agreeing(gains) == len(gains) - 1
    if abs(abs(1 + row.value) - 1) < USUAL or (low > FOLLOWS * high and not grows):
        return own, ()
    much, gain = "much" if low > FOLLOWS * high else "most", abs(1 + row.value)
    half = min(0.5 * (high - low) + max(low - gain, gain - high, 0.0), 1.0)
    # A table that turns one way more than the other: what the gain lacks, the level has.
    u = problem.bins.mean(tuple(e.u for e in problem.exposures)) / problem.gain
    mean = float(np.mean(u))
    wider = {SCALE: half} | {t.effect.id: half * abs(mean) for t in own if t.effect.part == "level"}
    own = {
        t: tuple(replace(row, sd=math.hypot(row.sd, wider.get(t.effect.id, 0.0))) for row in rows)
        for t, rows in own.items()
    }
    if abs(mean) > ONE_RATE * float(np.std(u)):
        return own, ()  # a table at one rate: of its gain nothing was asked, and bias and scale factor are as uncertain
    return own, (
        f"{much} of the change of the reference, or of the reading, is noise that the other has not: the gain is "
        f"anything from {low:.2g}, by the reference, to {high:.2g}, by the reading",
    )


def _between(problem: Problem) -> tuple[float, float]:
    """Size of the gain of the reading on the reference, and of one over that of the reference on the reading."""
    rate = problem.bins.mean(tuple(e.motion.rate for e in problem.exposures))
    used = ~problem.bins.held_out
    used[list(problem.outliers)] = False
    together = of_rate = of_reading = 0.0
    means = np.zeros_like(rate)
    for run in np.unique(problem.bins.run[used]):
        one = used & (problem.bins.run == run)
        means[one] = rate[one].mean()
        u, y = (values[one] - values[one].mean() for values in (rate, problem.y + rate))
        together, of_rate, of_reading = together + float(u @ y), of_rate + float(u @ u), of_reading + float(y @ y)
    whole = float(rate[used] @ rate[used])
    if of_rate < CHANGING**2 * whole and np.ptp(means[used]) > CHANGING * np.abs(means[used]).max():
        return 1.0, 1.0  # at one rate a run, runs tell the gain
    if not together:
        return 0.0, np.inf
    gain = abs(problem.gain)  # the rate is that times it
    return gain * abs(together) / of_rate, gain * of_reading / abs(together)
