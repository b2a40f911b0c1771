"""What all rows of a unit that turns tell of every effect, where fitted and held-out ones apart do not decide.

A search fits 60 % of a recording and lets the others judge: of a minute in which a robot is fastest at the end, an
asymmetry that all rows tell by nine deviations is three of the fitted ones, and beside a late reference no law. So,
once nothing is left to be added, each effect is asked of all rows as well, beside all that was added, as the search
asks: likelihood ratio with the noise fitted anew, its shapes and the number of effects paid for, errors of the
reference in its evidence (`insenv.identify.search.artefacts.reference_errors`), its coefficients credible and the same
all the time. Waves of the table's angle of which it turns by less than two beside a late reference are asked too.

Nothing is named by this, for no row is left that could refuse it; of what is beyond doubt other folds of the rows are
asked (`insenv.identify.folds`). What is certain is a doubt; where there is a doubt
anyway, what would follow the rest best is said with it, and what would do so nearly as well. A doubt needs six
deviations, as a curve of a measured rate of any number of looks does (`insenv.identify.search.size`), and an effect
that is not rare (`Effect.unusual`): of 24 tables without a fault one had a lock-in by 5.6 of all rows, 5e-6 by chance,
made by its encoder's steps about standstill.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from insenv.effects.timing import TimingSkew
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Problem
from insenv.identify.search.all_rows import at_all_times, whole_of
from insenv.identify.search.artefacts.reference_errors import beside_reference_errors, log_p_alone
from insenv.identify.search.artefacts.rounded import beside_rounding, beside_steps
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.doubts.sizes import UNSIGNED
from insenv.identify.search.jumps import is_step
from insenv.identify.search.round import by_fit_alone, no_law, with_term
from insenv.identify.search.scan import Hit, Reference, largest_statistic, reference
from insenv.identify.search.size import unsized
from insenv.identify.search.tracks import Track

#: Probability, all that was tried paid for, and deviations of a coefficient from which on an effect is a doubt.
CERTAIN, MANY = 1e-3, 6.0
#: Score statistic from which on an effect is worth fits of noise.
SEEN = 9.0
#: Likelihood ratio by which another effect may fall behind the best and follow the rest nearly as well.
NEAR = 6.0
#: How many are said at most.
MOST = 3
#: Probability, all that was tried paid for, below which other folds of the rows are asked for an effect.
SURE = 1e-6


def followers(track: Track, alpha: float, doubted: bool) -> tuple[str, ...]:
    """Effects that all rows of a unit that turns tell beside the model, in words.

    Parameters
    ----------
    track : Track
        At the end of its search.
    alpha : float
        Level from which on they are said where there is a doubt anyway.
    doubted : bool
        Whether there is one.
    """
    if not track.problem.turns:
        return ()
    hits = _by_all_rows(track)
    told = [hit for hit in hits if hit.log_p < math.log(alpha if doubted else CERTAIN) and not hit.remark]
    if not doubted:
        told = [hit for hit in told if not hit.candidate.effect.unusual and _is_sized(*_all_fitted(track), hit)]
    if not told:
        return ()
    best = max(told, key=lambda hit: hit.rank)
    near = [h for h in hits if h not in told and h.likelihood_ratio > best.likelihood_ratio - NEAR]
    near = sorted((h for h in near if log_p_alone(h) < math.log(alpha)), key=lambda h: -h.likelihood_ratio)
    others = sorted((h for h in told if h is not best), key=lambda h: -h.rank)
    if _lag_is_said(track) and any(isinstance(h.candidate.effect, TimingSkew) for h in (best, *others, *near)):
        return ()
    names = [h.candidate.effect.key for h in (*others, *near)[: MOST - 1]]
    also = f", each by itself {' and '.join(names)} as well" if names else ""
    return (
        f"{best.candidate.effect.key} explains all rows, the held-out ones too, better than noise does (p = "
        f"{best.p_value:.1g} among all that was tried){also}: not named, for no rows are left that could refuse it",
    )


def surest(track: Track) -> Hit | None:
    """The law that all rows of a unit that turns tell beyond doubt, and the fitted ones did not; None where none is.

    A step is none: errors of a reference jump.
    """
    if not track.problem.turns or track.law is not None:
        return None
    told = [hit for hit in _by_all_rows(track) if hit.log_p < math.log(SURE) and not hit.remark]
    best = max(told, key=lambda hit: hit.rank, default=None)
    if best is None or is_step(best.candidate.effect):
        return None
    return None if isinstance(best.candidate.effect, TimingSkew) and _lag_is_said(track) else best


def _lag_is_said(track: Track) -> bool:
    """Whether it was said that the reading is late by an amount of no sign: what that explains as well is no news."""
    return any(refusal.reason.startswith(UNSIGNED) for refusal in track.refusals)


def _all_fitted(track: Track) -> tuple[Problem, Fit]:
    """All rows of a track fitted with its model."""
    whole = whole_of(track)
    return whole, solve(whole, track.fit.model, start=track.fit.noise.power)


def _by_all_rows(track: Track) -> tuple[Hit, ...]:
    """Effects that are credible beside the model by all rows, as they are beside errors of the reference."""

    def asked() -> tuple[Hit, ...]:
        whole, fit = _all_fitted(track)
        base = reference(whole, fit.model, fit.noise.power)
        tried = tuple(c for c in _open(track) if largest_statistic(whole, base, (c,)) >= SEEN)
        hits = by_fit_alone(whole, fit, base, tried, 0, track.family, tones=False)
        return tuple(one for hit in hits if (one := _judged(whole, fit, base, hit)) is not None)

    found: tuple[Hit, ...] = track.problem.remember(("followers", track.fit.model), asked)
    return found


def _judged(whole: Problem, fit: Fit, base: Reference, hit: Hit) -> Hit | None:
    """The hit beside steps and errors of the reference; None where it is no effect, or nothing by itself."""
    if hit.log_p >= 0:
        return None
    larger = solve(whole, with_term(fit.model, hit.term), start=fit.noise.power)
    if no_law(whole, fit, base, larger):
        return None
    return beside_reference_errors(whole, fit, base, beside_steps(whole, larger, beside_rounding(whole, larger, hit)))


def _open(track: Track) -> Sequence[Candidate]:
    """Effects that nobody named, alone or in a set, and of which nothing was said otherwise."""
    said = {step.hit.candidate.effect.key for step in track.steps}
    said |= {key for one in track.rivalries for key in (*one.rivals, *one.rarer)}
    said |= {term.effect.key for term in track.fit.model}
    tried = (*track.candidates, *track.few_waves)
    whole = whole_of(track)
    return [at_all_times(whole, c) for c in tried if not c.generic and c.effect.key not in said]


def _is_sized(whole: Problem, fit: Fit, hit: Hit) -> bool:
    """Whether an effect's size is told, and many deviations from nothing."""
    larger = solve(whole, with_term(fit.model, hit.term), start=fit.noise.power)
    own = larger.design.term == len(larger.model) - 1
    many = float(np.max(np.abs(larger.theta[own]) / larger.sd[own], initial=0.0)) >= MANY
    return many and not unsized(whole, larger, hit.term, looks=hit.looks)
