"""Which procedure would tell confounded effects apart: candidates ranked by what they would show, best first.

For a set of effects that the recording does not tell apart, every procedure of `insenv.identify.next.procedures` is
simulated (`insenv.identify.next.simulated`), and `insenv.identify.next.separation` tells how clearly it would separate
each pair. The smallest of the pairs ranks a procedure. Where none tells all of a set apart, its pairs are proposed for
one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from insenv.core.estimate import Limits
from insenv.core.recording import Floats, Recording
from insenv.effects.catalogue import by_key
from insenv.effects.own import ALL
from insenv.identify.findings import Added, NextExperiment, Pair
from insenv.identify.fit.gls import Fit, solve, spectrum
from insenv.identify.fit.problem import NOISE_TERMS, Model, Problem, Term
from insenv.identify.next.points import in_other_orders
from insenv.identify.next.procedures import Procedure, procedures
from insenv.identify.next.separation import Contest, Known, Rival, sized, whole
from insenv.identify.next.simulated import Recorded, further
from insenv.identify.search.earth_rate import Check
from insenv.identify.search.rivals import Rivalry
from insenv.identify.search.tracks import Track

#: Standard deviations from which a procedure is said to separate a pair: the rival of one or two parameters is then
#: dropped at p = 0.01 in 97 of 100 recordings that are fitted whole, in nine of ten where 40 % of rows are held out.
SEPARATES = 5.0
#: Size that is assumed of an effect that hides in declared ones: it puts them off by so many standard deviations.
SPOILT = 10.0
#: The same below which it shows nothing of them: a size that would be seen is none.
NOT_AT_ALL = 1e-3
#: Procedures told of one set; of a set that no residual shows.
MOST, MOST_HIDDEN = 4, 1

#: By the id of an effect, the family in which effects hide each other.
_HIDES = {effect.id: effect.hides for effect in ALL}
#: Which declared effects can hide an effect on a recording that cannot tell them apart.
_HIDDEN_BY = {"encoder": ("earth", "angle"), "angle": ("earth",), "rate": ("rate", "bias")}
_NOISE = tuple(term.id for term in NOISE_TERMS)


@dataclass(frozen=True)
class Confounded:
    """A set of effects: the first is the one that was added, with its parameters; ``model`` is all the rest.

    Attributes
    ----------
    rivals : tuple of Rival
    model : Model
    assumed : bool
        Whether nobody knows the size of the first: it is one that spoils the declared effects by `SPOILT` deviations.
    earth : ndarray, shape (2,)
        What latitude and tilt tell of the horizontal Earth rate (`insenv.identify.next.separation.RecordedRuns.known`).
    """

    rivals: tuple[Rival, ...]
    model: Model
    assumed: bool = False
    earth: Floats = field(default_factory=lambda: np.zeros(2))


@dataclass(frozen=True, eq=False)
class _Bench:
    """What a set is judged with: the recorded runs, the further one of each procedure, and the noise."""

    track: Track
    recorded: Problem
    further: tuple[tuple[Procedure, Problem], ...]

    @classmethod
    def of(cls, track: Track, recordings: tuple[Recording, ...], limits: Limits | None) -> _Bench:
        recorded, like = whole(track.problem), Recorded.of(recordings[0])
        earth = any(t.effect.of_earth for t in track.prepared.model)
        if recorded.in_points:
            return cls(track, recorded, in_other_orders(recorded, recordings[0], earth))
        if recorded.through_gravity:
            return cls(track, recorded, ())
        most = limits.acceleration if limits is not None else np.inf
        found = [(p, further(p.plan, like, recorded, earth, most)) for p in procedures(recordings, limits)]
        return cls(track, recorded, tuple(found))

    def contest(self, confounded: Confounded, a: Rival, b: Rival) -> Contest | None:
        """What a pair is compared by; None where neither has a size."""
        one, other = (a, b) if a.theta is not None else (b, a)
        if one.theta is None or one.key in _NOISE:
            return None
        start = self.known(confounded)
        if other.key in _NOISE:
            # More noise instead of the effect: how clearly it stands out of noise that is fitted without it.
            free = replace(self.track.problem, most=None, cache={})
            start, other = replace(start, power=solve(free, confounded.model).noise.power), Rival(other.key)
        if _trait(other.key) == "earth":
            start = replace(start, earth=np.zeros(2))  # another magnitude of it is the rival
        return Contest(start, one, other)

    def known(self, confounded: Confounded) -> Known:
        """What the recorded runs tell."""
        return Known(self.recorded, self.track.fit.noise.power, confounded.model, confounded.earth)


@dataclass(frozen=True)
class Unsettled:
    """What a search leaves open beside the rivals of what was added.

    Attributes
    ----------
    suspects : tuple of Added
        Effects that no residual shows, but the magnitude of the Earth rate.
    collinear : tuple of str
        Keys of effects that this recording cannot tell from the declared ones: what one of them does is now in the
        declared parameters, and no residual shows it.
    check : Check, optional
        Of the magnitude of the Earth rate.
    """

    suspects: tuple[Added, ...] = ()
    collinear: tuple[str, ...] = ()
    check: Check | None = None


def next_experiments(
    track: Track, recordings: tuple[Recording, ...], unsettled: Unsettled, limits: Limits | None = None
) -> tuple[NextExperiment, ...]:
    """Procedures for every confounded set, best first.

    Parameters
    ----------
    track : Track
        At the end of a search.
    recordings : tuple of Recording
    unsettled : Unsettled
    limits : Limits, optional
        Of the table; without them it goes no faster than it has gone.
    """
    sets = [*_suspected(track, unsettled), *_found(track)]
    hidden = _hidden(track, sets, unsettled.collinear)
    if not sets and not hidden:
        return ()
    bench = _Bench.of(track, recordings, limits)
    told = [one for confounded in sets for one in _ranked(bench, confounded, MOST)]
    return (*told, *(one for confounded in hidden for one in _ranked(bench, confounded, MOST_HIDDEN)))


def _found(track: Track) -> Iterator[Confounded]:
    """Sets of the added effects."""
    for index, step in enumerate(track.steps):
        rivals = track.rivalries[index] if index < len(track.rivalries) else Rivalry((), None)
        shaped = dict(zip(rivals.rivals, rivals.terms, strict=False))
        keys = (*rivals.keys, *track.instead)
        if keys:
            term = step.hit.term
            rest = tuple(t for t in track.fit.model if t is not term)
            first = Rival(term.effect.key, (term, *_grid(track, term)), _theta(track.fit, term))
            yield Confounded((first, *(_rival(track, key, rest, shaped.get(key)) for key in keys)), rest)


def _suspected(track: Track, unsettled: Unsettled) -> Iterator[Confounded]:
    """Sets that the magnitude of the Earth rate gave away; that it is known is part of what tells them apart."""
    check = unsettled.check
    earth = np.zeros(2) if check is None else check.earth.along / check.level.sd
    for one in unsettled.suspects:
        term = Term(by_key(one.effect if one.order is None else f"{one.effect}:{one.order}"))
        first = Rival(term.effect.key, (term,), np.array([p.value for p in one.parameters]))
        others = tuple(_rival(track, key, track.fit.model) for key in one.confounded_with)
        yield Confounded((first, *others), track.fit.model, earth=earth)


def _hidden(track: Track, told: list[Confounded], collinear: tuple[str, ...]) -> list[Confounded]:
    """Effects that hide in declared ones, of a size that is credible; one set for each way to hide."""
    # A set without the Earth rate may be settled, and a rate locked to the angle still be taken for the Earth's.
    names = [[r.key for r in one.rivals] for one in told]
    known = {key for keys in names for key in keys if _trait(key) != "angle" or "earth" in map(_trait, keys)}
    declared = track.prepared.model
    sets: dict[str, Confounded] = {}
    for key in collinear:
        trait = _trait(key)
        hiding = [t.effect.key for t in declared if _trait(t.effect.key) in _HIDDEN_BY.get(trait, ())]
        if key in known or not hiding or trait in sets:
            continue
        term = next(c.terms[0] for c in track.candidates if c.effect.key == key)
        rivals = (Rival(key, (term,), _spoiling(track, term)), *(Rival(h) for h in hiding))
        sets[trait] = Confounded(rivals, track.fit.model, True)
    return list(sets.values())


def _spoiling(track: Track, term: Term) -> Floats:
    """Parameters of an effect that hides: it puts the declared ones off by `SPOILT` standard deviations in all."""
    white = track.problem.transformed(term) / np.sqrt(spectrum(track.problem, track.fit.noise.power))[:, None]
    size = np.linalg.norm(white, axis=0)
    even = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
    return np.asarray(SPOILT * even / max(float(np.linalg.norm(white @ even)), 1e-300))


def _rival(track: Track, key: str, model: Model, found: Term | None = None) -> Rival:
    """A rival by its key: with the terms of the search, or without any where the model has it or it is noise.

    A tone has none but the one that was ``found``.
    """
    if key in _NOISE or any(t.effect.key == key for t in model):
        return Rival(key)
    terms = next((c.terms for c in track.candidates if c.effect.key == key), None)
    return Rival(key, terms if terms is not None else (found or Term(by_key(key)),))


def _grid(track: Track, term: Term) -> tuple[Term, ...]:
    """Other shapes of a term."""
    if not term.shape:
        return ()
    return next((c.terms for c in track.candidates if c.effect.key == term.effect.key), ())


def _theta(fit: Fit, term: Term) -> Floats:
    """Linear parameters of a term; zero where they were left out."""
    place = next(i for i, t in enumerate(fit.model) if t is term)
    values = {fit.design.labels[j][1]: fit.theta[j] for j in np.flatnonzero(fit.design.term == place)}
    return np.array([values.get(p.name, 0.0) for p in term.effect.linear])


def _ranked(bench: _Bench, confounded: Confounded, most: int) -> list[NextExperiment]:
    """Procedures for a set, best first; for its pairs where none tells all of it apart."""
    keys = tuple(r.key for r in confounded.rivals)
    contests = _contests(bench, confounded) if bench.further else []
    rows = [_judged(bench, confounded, contests, *one) for one in bench.further]
    known = [row for row in rows if row.expected_separation_sigma is not None]
    if not known:
        return [_unknown(bench, confounded, keys)]
    known.sort(key=lambda row: -(row.expected_separation_sigma or 0.0))
    if (known[0].expected_separation_sigma or 0.0) >= SEPARATES:
        return _listed(known, most)
    if len(keys) > 2 and (pairs := _by_pairs(known, keys, most)):
        return pairs
    return [_not_clearly(known[0], len(known))]


def _not_clearly(row: NextExperiment, count: int) -> NextExperiment:
    """The best of ``count`` procedures, with words that it does not separate its effects clearly."""
    if (row.expected_separation_sigma or 0.0) < NOT_AT_ALL:
        return replace(row, procedure=f"none of {count} procedures that were tried separates them")
    now = f"{row.procedure}: the best of {count} procedures that were tried, and none separates them clearly"
    return replace(row, procedure=now)


def _contests(bench: _Bench, confounded: Confounded) -> list[tuple[Rival, Rival, Contest]]:
    """Every pair of a set that can be compared, with what it is compared by."""
    first, *others = confounded.rivals
    pairs = [(first, b) for b in others]
    if not confounded.assumed:
        pairs += combinations(_sized(bench, confounded, others), 2)
    contests = ((a, b, bench.contest(confounded, a, b)) for a, b in pairs)
    return [(a, b, contest) for a, b, contest in contests if contest is not None]


def _judged(
    bench: _Bench,
    confounded: Confounded,
    contests: list[tuple[Rival, Rival, Contest]],
    procedure: Procedure,
    run: Problem,
) -> NextExperiment:
    """What a procedure would show of every pair of a set; nothing where its regressors cannot be told."""
    rivals = confounded.rivals
    sigmas = [(a, b, contest.separation(run)) for a, b, contest in contests if not _lacks(run, a, b)]
    told = tuple(Pair((a.key, b.key), s) for a, b, s in sigmas)
    words = procedure.words
    least = min((p.sigma for p in told), default=None)
    if confounded.assumed and least and least > NOT_AT_ALL:
        words += f" ({_smallest(bench, rivals[0], least)})"
    return NextExperiment(
        tuple(r.key for r in rivals), words, least, procedure.profile, procedure.told, told, procedure.control
    )


def _sized(bench: _Bench, confounded: Confounded, rivals: Sequence[Rival]) -> list[Rival]:
    """Rivals that could be true themselves, of the size that takes the place of the first."""
    first = confounded.rivals[0]
    return [
        _fitted(bench, confounded, first, r) for r in rivals if r.terms and r.key not in _NOISE and not _lacks(None, r)
    ]


def _fitted(bench: _Bench, confounded: Confounded, first: Rival, rival: Rival) -> Rival:
    term, theta = sized(bench.known(confounded), first, rival)
    return Rival(rival.key, (term, *rival.terms), theta)


def _listed(rows: list[NextExperiment], most: int) -> list[NextExperiment]:
    """The best, without a repeat unless it is one of them by right."""
    good = [row for row in rows if (row.expected_separation_sigma or 0.0) >= SEPARATES]
    return good[:most]


def _by_pairs(rows: list[NextExperiment], keys: tuple[str, ...], most: int) -> list[NextExperiment]:
    """The best procedure for each pair that some procedure separates, the likeliest pairs first, as ``keys`` are.

    Of those that none separates clearly the pairs of the first are said, for it has the name. Empty where there are
    these alone.
    """
    best: dict[tuple[str, str], NextExperiment] = {}
    for row in rows:
        for pair in row.pairs:
            known = best.get(pair.effects)
            if known is None or pair.sigma > (known.expected_separation_sigma or 0.0):
                best[pair.effects] = replace(row, separates=pair.effects, expected_separation_sigma=pair.sigma)
    clear = {pair for pair, row in best.items() if (row.expected_separation_sigma or 0.0) >= SEPARATES}
    if not clear:
        return []
    told = sorted((p for p in best if p in clear or p[0] == keys[0]), key=lambda p: [keys.index(key) for key in p])
    return [best[pair] if pair in clear else _not_clearly(best[pair], len(rows)) for pair in told][:most]


def _smallest(bench: _Bench, rival: Rival, sigma: float) -> str:
    """The size that would just be seen."""
    assert rival.theta is not None
    size = float(np.linalg.norm(rival.theta)) * SEPARATES / sigma
    unit = bench.track.problem.names(rival.terms[0])[0][1]
    return (
        f"{rival.key} of {size:.2g}{'' if unit == '1' else ' ' + unit} would show at {SEPARATES:g} standard deviations"
    )


def _unknown(bench: _Bench, confounded: Confounded, keys: tuple[str, ...]) -> NextExperiment:
    """Where nothing can be computed, why."""
    needs = sorted({n for _, run in bench.further for n in _needs(run, confounded.rivals)})
    lacking = f"it needs {', '.join(needs)}, which cannot be simulated here" if needs else "no procedure is known"
    return NextExperiment(keys, f"a longer recording; what would separate them is not computed: {lacking}", None)


def _needs(run: Problem | None, rivals: Sequence[Rival]) -> set[str]:
    """What a further run does not have of what effects depend on."""
    if run is None:
        return set()
    motion = run.exposures[0].motion
    return {need for r in rivals for term in r.terms[:1] for need in term.effect.missing(motion)}


def _lacks(run: Problem | None, *rivals: Rival) -> bool:
    return bool(_needs(run, rivals))


def _trait(key: str) -> str:
    return _HIDES.get(key.partition(":")[0], "")
