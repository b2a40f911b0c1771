r"""Slow causes of a unit at rest that a record does not tell from a walk of the noise: a set, with the noise in it.

That the level changes may be certain while its cause is not: a drift, a warm-up, what the temperature does, or a random
walk. Where a doubt says that it does (`doubted`), a law l is a rival of the noise, fitted freely with and without it to
all rows, if its likelihood ratio is what chance gives in one case of twenty,

    Lambda_l > chi2_k(1 - `CHANCE`),        k its parameters, shapes included,

and the best of them by Lambda - 2 k that does not make the held-out data worse, with the shape that the fitted rows
give it, is named: with the others as its rivals, a step of the bias where that explains more, and the noise. What is
over soon after the start is an event (`insenv.identify.clean.settling`), and none of them.

So it is for the bias of a unit that turns beside a reference, whatever else was added, where such a law is told from
noise or is likelier than its walk by `NAMED`: of 120 minutes of noise that walks as far as white noise of the minute's
mean, and ten times as far, 10 have such a set, with the walk in it; of 60 with white noise none.

Source: H. Akaike, IEEE Trans. Autom. Control 19 (1974) 716 (Lambda - 2 k).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from insenv.identify.clean.settling import settled_by
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import CHANCE as CHANCE_OF_ROWS
from insenv.identify.fit.heldout import MOST_GROWTH, Score, confirms, held_out_score, rescored
from insenv.identify.fit.problem import NOISE_TERMS, Problem
from insenv.identify.prepare.vibration import went_away
from insenv.identify.search.all_rows import (
    AllRows,
    may_move_bias,
    of_all_rows,
    of_all_rows_beside_a_reference,
    of_longer_means,
    of_rests,
    surest_slow,
    whole_of,
)
from insenv.identify.search.jumps import is_step
from insenv.identify.search.rivals import Rivalry
from insenv.identify.search.round import by_fit_alone, with_term
from insenv.identify.search.scan import Hit, reference
from insenv.identify.search.staying import Staying
from insenv.identify.search.tracks import Step, Track
from insenv.identify.search.unit.one_box import (
    DRIFTS,
    LEAST,
    in_common,
    is_thermal,
    log_p_by_itself,
    looks_of,
    own_looks,
    surest,
)
from insenv.identify.search.unit.turn_on import each_its_own, turned_on_anew

#: Probability with which noise alone gives the likelihood ratio from which on a law is its rival.
CHANCE = 0.05
#: Probability with which noise that stays gives the likelihood ratio from which on a law is certain beside it (four
#: deviations), and the odds for the law over a walk from which on that is said. Of 19 sound simulated units of six with
#: an ordinary flicker seven have a channel that is doubted; with odds and levels for all channels of a unit four had,
#: and of 218 recordings of others three that were right were not.
CERTAIN, LIKELIER = 6.3e-5, 50.0
#: Odds over a walk from which on laws beside a reference are named with it, in a set.
NAMED = 300.0
#: Probability by itself up to which a law that foretells held-out rows better is named in a set.
FORETELLS = 0.1
#: Share of the time within which a law is over that is none, and share of its curve that is then left at most.
SOON = 0.05
#: Beside a reference: probability after its looks with which noise makes a slow law of the bias, and deviations of its
#: coefficient, from which on it is said.
BESIDE, MANY = 1e-3, 5.0
#: The same probability up to which a law is asked of longer means at all: a hump of the motion there looks rounded, and
#: what is rounded leaves slow modes nothing, beside which each law is certain.
LONGER = 1e-2
#: Deviations of noise that stays from which on such a law is said where there is a doubt anyway.
BEYOND = 6.0
#: Deviations, beside noise that may wander, that a law of such a set is of at least.
LEAST_SIZE = 0.3
#: Probability among all that was tried up to which a law that would be significant by itself is said: at one in ten six
#: of 262 units without any had one, and of 483 with an effect none that was not said otherwise.
LEANS = 0.02
#: Share of the slowest mode's variance that a noise term must make to be told.
SHARE = 0.1


def leaning(track: Track, alpha: float) -> tuple[str, ...]:
    """A slow cause that would be significant if nothing else had been tried, in words.

    Of a unit that turns: one of its bias that all rows tell (`_beside_a_reference`).
    """
    if track.problem.turns:
        return _beside_a_reference(track)
    named = any(not step.hit.candidate.effect.line for step in track.steps)
    if named or any(r.of_box or r.fails for r in track.refusals):
        return ()
    hits = [hit for hit in track.last_physical if _is_slow(hit)]
    found = min(hits, key=lambda hit: _log_p_among_its_like(track, hit), default=None)
    log_p = 0.0 if found is None else _log_p_among_its_like(track, found)
    if found is None or log_p >= np.log(alpha) or found.p_value >= LEANS:
        return _by_all_rows(track, alpha)
    return (
        f"{found.candidate.effect.key} explains the data better than noise does (p = {np.exp(log_p):.1g} by itself, "
        f"{found.p_value:.1g} among all that was tried): not decided between it and a random walk",
    )


def _log_p_among_its_like(track: Track, hit: Hit) -> float:
    """Logarithm of the p-value by itself; of what the temperature does among all that it may do."""
    thermal = is_thermal(hit.candidate.effect)
    like = sum(is_thermal(one.candidate.effect) for one in track.last_physical) if thermal else 1
    return min(0.0, log_p_by_itself(track, hit) + math.log(like))


def _by_all_rows(track: Track, alpha: float) -> tuple[str, ...]:
    """A slow cause that the fitted rows do not tell from a walk of the noise, and all rows do."""
    found = surest_slow(track)
    if found is None or found[1] >= alpha:
        if track.wanders:
            return ()  # the walk is the maker's own
        return _in_place_of_a_walk((*_likelier(track), *_stepping(track)))
    return (_better_than_noise(*found),)


def _better_than_noise(hit: Hit, p: float) -> str:
    return (
        f"{hit.candidate.effect.key} explains all rows, the held-out ones too, better than noise does (p = {p:.1g} by "
        "itself): no rows are left that could refuse it"
    )


def _beside_a_reference(track: Track) -> tuple[str, ...]:
    """A slow cause of the bias of a unit that turns that all rows tell, where nothing that was named may be it.

    It is certain beside noise that stays, many deviations beside noise that may wander, and either told from such noise
    or likelier than a walk. One of these alone is not enough: errors of a reference wander, and jump.
    """
    asked = _rows_beside(track)
    for rows in asked:
        if (found := _told_beside(rows, track)) is not None:
            return (_better_than_noise(*found),)
    sure = [one for rows in asked for one in _sure_beside(rows, track)]
    walk = _in_place_of_a_walk([one for one in sure if one.odds >= math.log(LIKELIER)])
    return walk or (() if may_be_slow(track) else _by_rests(track))


def beside_doubts(track: Track, doubted: bool) -> tuple[str, ...]:
    """A slow law of the bias of a unit that turns that longer means tell less surely, where there is a doubt anyway.

    It is `BEYOND` deviations of noise that stays, and likelier than a walk: neither a name nor a doubt by itself. What
    motion leaves made such by 4.3 to 4.8 deviations in three of twenty runs, and in none by more.

    Parameters
    ----------
    track : Track
        At the end of its search.
    doubted : bool
        Whether there is a doubt.
    """
    if not doubted or not track.problem.turns or may_be_slow(track) or _beside_a_reference(track):
        return ()
    rows = of_longer_means(track)
    if rows is None:
        return ()
    likelier = [one for one in _beside_staying(rows, track) if one.odds >= math.log(LIKELIER)]
    lasting = [one for one in likelier if one.ratio >= BEYOND**2 and not _is_over_soon(rows.problem, one.hit)]
    return _in_place_of_a_walk(lasting, f"by means over {rows.problem.bins.width:.2g} s")


def _rows_beside(track: Track) -> tuple[AllRows, ...]:
    """All rows of a unit that turns, in its means and in longer ones, of which no slow cause was named."""
    if may_be_slow(track):
        return ()
    asked = (of_all_rows_beside_a_reference(track), of_longer_means(track))
    return tuple(rows for rows in asked if rows is not None)


def _rows_that_name(track: Track) -> AllRows | None:
    """The rows by which a set of such laws and noise is named; None where none is.

    They are told from noise, or likelier than a walk by `NAMED`.
    """
    for rows in _rows_beside(track):
        if _told_beside(rows, track) is not None:
            return rows
        if any(one.odds >= math.log(NAMED) for one in _sure_beside(rows, track)):
            return rows
    return None


def _told_beside(rows: AllRows, track: Track) -> tuple[Hit, float] | None:
    """The surest of these laws that all rows tell from noise that may wander, and its p-value; None where none is."""
    sure = [one.hit for one in _sure_beside(rows, track)]
    found = min(sure, key=lambda hit: log_p_by_itself(track, hit), default=None)
    if found is None:
        return None
    looks = len(rows.laws) if rows.problem is whole_of(track) else 2 * len(rows.laws)  # both kinds of means were asked
    p = looks * math.exp(log_p_by_itself(track, found))
    return (found, p) if p < BESIDE else None


def _sure_beside(rows: AllRows, track: Track) -> list[_Likelier]:
    """Laws of the bias that are certain beside noise that stays, and many deviations beside noise that may wander."""

    def asked() -> list[_Likelier]:
        lasting = [one for one in _beside_staying(rows, track) if not _is_over_soon(rows.problem, one.hit)]
        many = [one for one in lasting if _deviations(rows, one.hit) >= MANY]
        least = 0.0 if rows.problem is whole_of(track) else math.log(LONGER / len(rows.laws))
        return [one for one in many if log_p_by_itself(track, one.hit) <= least]

    sure: list[_Likelier] = rows.problem.remember(("sure beside", rows.fit.model), asked)
    return sure


def _is_over_soon(problem: Problem, hit: Hit) -> bool:
    """Whether a law has come to its end in so small a share of the time (`SOON`): an event at the start, and no law."""
    curve = problem.columns(hit.term)[:, -1]
    return float(np.mean(np.abs(curve - curve[-1]) > SOON * np.ptp(curve))) < SOON


def _by_rests(track: Track) -> tuple[str, ...]:
    """A slow cause of the bias that the rests of a table tell, in which noise of its motion has no part."""
    rows = of_rests(track)
    if rows is None:
        return ()
    level = math.log(BESIDE / len(rows.laws))
    sure = [hit for hit in rows.laws if log_p_by_itself(track, hit) < level and _deviations(rows, hit) >= MANY]
    if not sure:
        return ()
    first, *others = sorted(sure, key=lambda hit: log_p_by_itself(track, hit))
    also = f", and {' and '.join(_keys(others))} by itself as well" if others else ""
    return (
        f"{first.candidate.effect.key} explains what the rests of the table show, in which noise of its motion has no "
        f"part, better than noise does (p = {len(rows.laws) * math.exp(log_p_by_itself(track, first)):.1g}){also}: "
        "not named, for no rows are left that could refuse it",
    )


def may_be_slow(track: Track) -> bool:
    """Whether a slow cause is named, or a rival of what is named."""
    rivals = {key for one in track.rivalries for key in (*one.rivals, *one.rarer)}
    slow = {c.effect.key for c in track.candidates if may_move_bias(c.effect)}
    return bool(slow & (rivals | {step.hit.candidate.effect.key for step in track.steps}))


def _deviations(rows: AllRows, hit: Hit) -> float:
    """Largest coefficient of a law by all rows, in its deviations beside noise that may wander."""
    _, fit = _fitted(rows, hit)
    own = fit.design.term == len(fit.model) - 1
    return float(np.max(np.abs(fit.theta[own]) / fit.sd[own], initial=0.0))


def _in_place_of_a_walk(likelier: Sequence[_Likelier], by: str = "by all rows") -> tuple[str, ...]:
    """A law without which there is a walk of the noise, and with which there is none, likelier than that."""
    found = max(likelier, key=lambda one: one.odds, default=None)
    if found is None:
        return ()
    stays = f"noise that correlates over {found.memory:.2g} s" if found.memory else "white noise"
    at = f" at {found.hit.term.shape[0]:.4g} s" if is_step(found.hit.candidate.effect) else ""
    return (
        f"{found.hit.candidate.effect.key}{at} beside {stays} is {math.exp(min(found.odds, 99.0)):.2g} times as likely "
        f"{by} as the walk of the noise that stands for it ({math.sqrt(found.ratio):.2g} deviations of that noise):"
        " not decided between them",
    )


@dataclass(frozen=True)
class _Likelier:
    """A law that is certain beside noise that stays: odds over a walk (logarithm), ratio beside no law, memory [s]."""

    hit: Hit
    odds: float
    ratio: float
    memory: float


def _likelier(track: Track) -> tuple[_Likelier, ...]:
    """Laws that are certain if noise does not wander, and likelier by `LIKELIER` than its walk.

    A law and a walk have a coefficient each; what a law has beyond that is paid for (Akaike). That the walk itself be
    certain is not asked: where the law is the truth, a walk is the worse the more it stands for.
    """
    rows = of_all_rows(track)
    if rows is None:
        return ()

    def asked() -> tuple[_Likelier, ...]:
        found = _certain(rows, [(hit, CERTAIN) for hit in rows.laws])
        return tuple(one for one in found if one.odds >= math.log(LIKELIER))

    said: tuple[_Likelier, ...] = rows.problem.remember(("likelier", rows.fit.model), asked)
    return said


def _stepping(track: Track) -> tuple[_Likelier, ...]:
    """A step that all rows of a unit at rest speak for so, its instants paid for: what walks to it is less likely.

    Of three recordings at rest into which steps of 25 deviations were put the odds were e^6 to e^16, untouched e^0.
    """
    rows = of_all_rows(track)
    best = None if rows is None else max(rows.steps, key=lambda hit: hit.likelihood_ratio, default=None)
    if rows is None or best is None:
        return ()
    step, looks = best, own_looks(track, best)

    def asked() -> tuple[_Likelier, ...]:
        paid = (replace(one, odds=one.odds - math.log(looks)) for one in _certain(rows, [(step, CERTAIN / looks)]))
        return tuple(one for one in paid if one.odds >= math.log(LIKELIER))

    said: tuple[_Likelier, ...] = rows.problem.remember(("stepping", rows.fit.model), asked)
    return said


def _beside_staying(rows: AllRows, track: Track) -> list[_Likelier]:
    """Laws of a unit that turns that are certain if noise does not wander, their shapes and their number paid for."""

    def asked() -> list[_Likelier]:
        looks = [len(rows.laws) * own_looks(track, hit) for hit in rows.laws]
        return _certain(rows, [(hit, BESIDE / n) for hit, n in zip(rows.laws, looks, strict=True)])

    certain: list[_Likelier] = rows.problem.remember(("beside staying", rows.fit.model), asked)
    return certain


def _certain(rows: AllRows, asked: Sequence[tuple[Hit, float]]) -> list[_Likelier]:
    """Laws that noise that stays makes of itself with less than the probability beside each."""
    model = rows.fit.model
    noise = Staying.of(rows.problem, model)
    without = noise.loglik(model)
    found = []
    for hit, chance in asked:
        with_it = noise.loglik(with_term(model, hit.term))
        ratio, odds = 2 * (with_it - without), with_it - noise.walking - (hit.size - 1)
        if hit.left * ratio > chdtri(hit.size, chance):
            found.append(_Likelier(hit, odds, ratio, noise.time))
    return found


def with_sets(tracks: Sequence[Track], alpha: float) -> list[Track]:
    """The tracks of a unit at rest with the slow causes that are not told from noise, each with its rivals.

    Parameters
    ----------
    tracks : sequence of Track
        At the end of their search, of channels whose noise nobody declared.
    alpha : float
        Level of the doubts.
    """
    together = _together(tracks, alpha)
    return [
        _with_set(track, alpha) if i in together or doubted(track, alpha) else track for i, track in enumerate(tracks)
    ]


def doubted(track: Track, alpha: float) -> bool:
    """Whether something says that the level of a unit changes, and no cause has been named.

    What the fitted rows alone lean to, or held-out ones refused, is said (`leaning`), and is no law by that: all rows
    have to say so too. Walks and flicker of simulated and of real rests had a set for every second such lean. Of a unit
    that turns beside a reference they have to say so whatever else there is.
    """
    if track.problem.turns:
        return _rows_that_name(track) is not None
    if not _is_open(track):
        return False
    generic = any(step.hit.candidate.generic for step in track.steps)
    smooth = any(r.hit.candidate.generic for r in track.refusals)
    went = bool(track.finer) and bool(went_away(track.problem, track.fit))
    anew = bool(turned_on_anew(track, alpha))
    return generic or smooth or went or anew or bool(_by_all_rows(track, alpha))


def _is_open(track: Track) -> bool:
    """Whether no cause was named, nor a step said that several axes have at one instant."""
    named = any(not s.hit.candidate.effect.line and not s.hit.candidate.generic for s in track.steps)
    return not named and not any(r.of_box and is_step(r.hit.candidate.effect) for r in track.refusals)


def _is_slow(hit: Hit) -> bool:
    return hit.candidate.effect.key in DRIFTS or is_thermal(hit.candidate.effect)


def _together(tracks: Sequence[Track], alpha: float) -> set[int]:
    """Channels that drift together by all rows, where nothing was named on any of them."""
    single = [(i, t) for i, t in enumerate(tracks) if len(t.problem.exposures) == 1]
    able = [(i, rows) for i, t in single if (rows := _open(t)) is not None]
    out: set[int] = set()
    for key in DRIFTS:
        hits = {i: hit for i, rows in able for hit in rows.laws if hit.candidate.effect.key == key}
        own = {i: hit for i, hit in hits.items() if hit.deviate >= LEAST}
        if len(own) < 2:
            continue
        looks = max(looks_of(tracks[i], hit) for i, hit in own.items())
        deviates = [hit.deviate for hit in hits.values()]
        if surest(deviates, looks) >= math.log(alpha):
            continue
        common, place = np.eye(len(hits)), [list(hits).index(i) for i in own]
        common[np.ix_(place, place)] = in_common([_fitted(dict(able)[i], hit) for i, hit in own.items()])
        if surest(deviates, looks, common) < math.log(alpha):
            out |= set(own)
    return out


def _open(track: Track) -> AllRows | None:
    """All rows of a track on which no cause was named."""
    return of_all_rows(track) if _is_open(track) else None


def _fitted(rows: AllRows, hit: Hit) -> tuple[Problem, Fit]:
    return rows.problem, solve(rows.problem, with_term(rows.fit.model, hit.term), start=rows.fit.noise.power)


def _with_set(track: Track, alpha: float) -> Track:
    """The track with the likeliest law that may be, or as it is where there is none."""
    turns = track.problem.turns
    rows = _rows_that_name(track) if turns else of_all_rows(track)
    if rows is None:
        return track
    likelier = [one.hit for one in (_beside_staying(rows, track) if turns else _likelier(track))]
    jumps = [] if turns else [one.hit for one in _stepping(track)]
    laws = [*jumps, *(hit for hit in rows.laws if _is_rival(hit) or hit in likelier)]
    laws.sort(key=_worth, reverse=True)
    keys = _keys(laws)
    problem, steps = track.problem, tuple(step for step in track.steps if not step.hit.candidate.generic)
    fit = solve(problem, rows.fit.model, start=track.fit.noise.power)
    score = held_out_score(problem, fit)
    for hit, larger, after in _confirmed(track, fit, score, keys):
        likely = next(one for one in laws if one.candidate.effect.key == hit.candidate.effect.key)
        foretells = after.rms < (1 - CHANCE_OF_ROWS) * score.rms
        if log_p_by_itself(track, likely) >= math.log(FORETELLS if foretells else alpha):
            continue  # all rows do not ask for it, and held-out ones are foretold no better than by chance
        judged = replace(hit, likelihood_ratio=likely.likelihood_ratio)
        step = Step(judged, score, after, math.exp(log_p_by_itself(track, likely)))
        beyond = (one for one in _steps_beyond(track, rows, likely) if one not in jumps)
        others = [one for one in (*laws, *_anew(track), *beyond) if one is not likely]
        found = Rivalry((), None, noise=_noise(rows)).beside(one.term for one in others)
        before = [r for s, r in zip(track.steps, track.rivalries, strict=True) if s in steps]
        refusals = tuple(r for r in track.refusals if not _is_slow(r.hit) and not r.hit.candidate.generic)
        return replace(
            track,
            fit=larger,
            score=after,
            steps=(*steps, step),
            rivalries=(*before, found),
            refusals=refusals,
        )
    return track


def _keys(hits: Sequence[Hit]) -> tuple[str, ...]:
    return tuple(hit.candidate.effect.key for hit in hits)


def _confirmed(track: Track, fit: Fit, score: Score, keys: Sequence[str]) -> Iterator[tuple[Hit, Fit, Score]]:
    """Laws with the shape that the fitted rows give them, their fits and scores, if held-out rows are not worse."""
    problem = track.problem
    base = reference(problem, fit.model, fit.noise.power)
    tried = tuple(c for c in track.candidates if c.effect.key in keys)
    hits = {h.candidate.effect.key: h for h in by_fit_alone(problem, fit, base, tried, 0, track.family, tones=False)}
    for key in keys:
        if key not in hits:
            continue
        larger = solve(problem, with_term(fit.model, hits[key].term), start=fit.noise.power)
        after = held_out_score(problem, larger)
        kept = after.rms <= (1 + MOST_GROWTH) * score.rms
        kept = kept and confirms(score, after, rescored(problem, fit, larger.noise.power))
        if kept and _credible(problem, larger) and settled_by(problem, hits[key].term) is None:
            yield hits[key], larger, after


def _credible(problem: Problem, fit: Fit) -> bool:
    """Whether the last term is known to less than its largest credible coefficients, and none is beyond them.

    Nor are all of them nothing: c = 10 +- 130 beside a walk is no law.
    """
    params = {p.name: p for p in fit.model[-1].effect.linear}
    own = np.flatnonzero(fit.design.term == len(fit.model) - 1)
    limits = [problem.limits(params[fit.design.labels[j][1].partition("[")[0]]) for j in own]
    sized = np.any(np.abs(fit.theta[own]) > LEAST_SIZE * fit.sd[own])
    return bool(sized) and all(
        fit.sd[j] < high and low - fit.sd[j] <= fit.theta[j] <= high + fit.sd[j]
        for j, (low, high) in zip(own, limits, strict=True)
    )


def _is_rival(hit: Hit) -> bool:
    return hit.likelihood_ratio > chdtri(hit.size, CHANCE)


def _worth(hit: Hit) -> float:
    return hit.likelihood_ratio - 2 * hit.size


def _steps_beyond(track: Track, rows: AllRows, law: Hit) -> Iterator[Hit]:
    """Steps that explain more than a law, the instants that were tried paid for."""
    for hit in rows.steps:
        if _is_rival(hit) and log_p_by_itself(track, hit) < log_p_by_itself(track, law):
            yield hit


def _anew(track: Track) -> Iterator[Hit]:
    """A bias of each run, where several runs were to have one."""
    hit = each_its_own(track)
    if hit is not None and _is_rival(hit):
        yield hit


def _noise(rows: AllRows) -> tuple[str, ...]:
    """The noise terms that make all rows wander without a law."""
    mode, power = rows.problem.modes(), rows.fit.noise.power
    slow, fast = (
        int(pick(np.where(mode.lam > 0, mode.lam, end))) for pick, end in ((np.argmin, np.inf), (np.argmax, 0))
    )
    wanders = [i for i in range(len(NOISE_TERMS)) if mode.shapes[slow, i] > 2 * mode.shapes[fast, i]]
    parts = mode.shapes[slow] * power
    told = [i for i in wanders if parts[i] > SHARE * parts.sum()]
    return tuple(NOISE_TERMS[i].id for i in told or wanders[-1:])
