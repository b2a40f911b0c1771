"""A bias that goes to and fro between two levels, or bends as no drift does: likelier than noise, and no effect."""

from __future__ import annotations

import numpy as np

from insenv.core.quantities import unit_for
from insenv.effects.spline import SplineTime
from insenv.identify.fit.gls import solve
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.prepare.two_levels import two_levels
from insenv.identify.search.all_rows import longer_means
from insenv.identify.search.staying import Staying
from insenv.identify.search.tracks import Track
from insenv.identify.search.undecided import may_be_slow

#: Odds over noise that wanders from which on a bias is said to go to and fro: with so many changes; and with fewer, of
#: which one alone is a step, and two about a few means are an event. Odds from which on it bends. Of 61 tables with
#: neither the largest were 200 and 220, and for one bend 3e4; of 107 channels at rest the largest were 4e5 and 1e4.
MANY_CHANGES, ODDS, FEWEST_CHANGES, SURE, SELDOM, BENDS, AT_REST = 4, 3e3, 2, 1e5, 0.1, 1e5, 1e6
#: Fewest means in which they are looked for.
FEWEST_SLOW = 100


def slow_without_a_name(track: Track) -> tuple[str, ...]:
    """A bias that goes to and fro between two levels, or bends, far likelier than noise that wanders.

    At rest the slow causes are asked whether they bend.
    """
    if len(track.problem.exposures) > 1 or may_be_slow(track):
        return ()
    longer = longer_means(track, FEWEST_SLOW)
    if longer is None:
        return ()
    asked = _slow if track.problem.turns else _to_and_fro
    return track.problem.remember(("slow", track.fit.model), lambda: asked(track, longer))


def _slow(track: Track, longer: Problem) -> tuple[str, ...]:
    return _to_and_fro(track, longer) or _bends(track, longer)


def _to_and_fro(track: Track, longer: Problem) -> tuple[str, ...]:
    fit = solve(longer, track.fit.model, start=track.fit.noise.power)
    left = longer.y - fit.predicted()
    if not np.ptp(left):  # readings that stand still but for some rows
        return ()
    variance = longer.modes().shapes @ fit.noise.power
    wandering = -0.5 * float(np.sum(np.log(2 * np.pi * variance) + transform(longer.fitted, left) ** 2 / variance))
    found = two_levels(left)
    many = found.changes >= MANY_CHANGES
    few = found.changes >= FEWEST_CHANGES and SELDOM <= found.share <= 1 - SELDOM
    least = (ODDS if many else SURE) if track.problem.turns else AT_REST
    if not (many or few) or found.loglik - wandering <= np.log(least):
        return ()
    apart, odds = unit_for(longer.unit, found.apart).show(found.apart), np.exp(min(found.loglik - wandering, 99.0))
    return (
        f"the bias goes to and fro between two levels {apart} apart, {found.changes} times (upper one "
        f"{found.share:.0%} of the time, by means over {longer.bins.width:.2g} s): {odds:.1g} times as likely as noise "
        "that wanders, and no effect",
    )


def _bends(track: Track, longer: Problem) -> tuple[str, ...]:
    model, noise = track.fit.model, Staying.of(longer, track.fit.model)
    curve = Term(SplineTime(count=3).over(longer.exposures[0].motion))
    odds = noise.loglik((*model, curve)) - noise.walking - (curve.size - 1)
    if odds <= np.log(BENDS):
        return ()
    return (
        f"the bias bends in time, by means over {longer.bins.width:.2g} s: a smooth curve beside noise that stays is "
        f"{np.exp(min(odds, 99.0)):.1g} times as likely as the walk of the noise that stands for it, and no drift, "
        "warm-up or step is told",
    )
