r"""What means over ever more rows tell of a gain and a skew beside a reference that was measured.

    y_m = g_m u_m + ...,        m = 1, 2, 4, ... times the rows of a bin; by the noise and the weights of the fit

Noise that the fit takes for slow gives fast motion weight, of which a reference with errors tells the least. Where
gains do not agree bins may be few: of a yaw in steps of 0.1 deg means of 0.4 s read 0.13 of a slow turn, and means of
1.5 s and 3 s all of it. Bins that lose half of the motion tell of no gain: those of 0.8 s of a stride of 1 s. What both
see, cov(u_m, y_m), is the motion: the errors of a reference are lost in longer means too.

Of a reference of whose errors nothing is known, a course of positions with straight lines between, short means tell
that it has some where they read less of the motion, g_m < 1 - `LOST`, and longer ones all of it:

    |g_M - 1| <= `WHOLE`,        g_M - g_m > `LOST`,        M the surest of those that agree with all longer ones

What an instrument's filter takes from fast motion looks the same, and is as well left to longer means.

A reference that errs from row to row in a cycle, a converter of which one step in four is larger, makes a skew of means
over a multiple of that, which depends on where they begin (`begun_later`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from insenv.core.recording import Recording, rows_between
from insenv.data.manifest.spec import Manifest
from insenv.data.split import RowUse
from insenv.effects.rate.scale import ScaleFactor
from insenv.effects.timing import TimingSkew
from insenv.identify.clean.doubtful import agreeing
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Model, Term
from insenv.identify.prepare.binned import binned
from insenv.identify.prepare.widths import FEWEST_AGREEING

#: Share of the power of the motion that means must leave.
LEFT = 0.5
#: Part of the motion that short means must lose, and by which the gain of long ones may differ from one.
LOST, WHOLE = 0.1, 0.1
#: Times the shortest means that agree that are taken where nothing is known of the errors: beside another model these
#: may as well be the other way.
FARTHER = 2

#: Rows by which other means begin later: cycles of a converter are of two, four or ten rows.
LATER = (1, 2, 3, 5)

#: Of means over more and more rows: how many, what they tell and its deviation.
Told = tuple[tuple[int, float, float], ...]


@dataclass(frozen=True)
class ToldByMeans:
    """Gain of the reading, and its skew where one run tells it [s], by means over ever more rows."""

    gains: Told = ()
    skews: Told = ()
    times: int = 1

    @property
    def rows(self) -> int:
        """So many ``times`` the fewest rows from which on all gains agree, of those that were asked."""
        return min(self.times * agreeing(list(self.gains)), self.gains[-1][0])


def of_known_errors(each: Iterable[ToldByMeans]) -> ToldByMeans:
    """What all lengths (`by_means`) tell, beside a reference that has errors of its own."""
    return _together(each, 1)


def of_unknown_errors(each: Iterator[ToldByMeans]) -> ToldByMeans:
    """The same beside a reference of whose errors nothing is known; nothing, unless short means tell that it has some.

    One length is asked alone where that reads the motion.
    """
    first = next(each, ToldByMeans())
    if not first.gains or abs(first.gains[0][1]) > 1 - LOST:
        return ToldByMeans()
    found = _together(chain([first], each), FARTHER)
    _, surest, _ = min((one for one in found.gains if one[0] >= found.rows), key=lambda one: one[2])
    whole = abs(abs(surest) - 1) <= WHOLE and abs(surest) - abs(found.gains[0][1]) > LOST
    return found if whole else ToldByMeans()


def _together(each: Iterable[ToldByMeans], times: int) -> ToldByMeans:
    parts = list(each)
    return ToldByMeans(
        tuple(g for one in parts for g in one.gains), tuple(s for one in parts for s in one.skews), times
    )


def by_means(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    target: str,
    rows: int,
    model: Model,
) -> Iterator[ToldByMeans]:
    """What means over so many ``rows``, and ever twice as many, tell as long as they leave the motion, one by one."""
    fitted, motion, wide = sum(int(use.fit.sum()) for use in uses), 0.0, rows
    free = (*(t for t in model if not isinstance(t.effect, (ScaleFactor, TimingSkew))), Term(ScaleFactor()))
    while manifest.held_out.averaging is None and (wide == rows or fitted >= FEWEST_AGREEING * wide):
        problem = binned(manifest, recordings, uses, target, wide)
        u = problem.bins.mean(tuple(e.u for e in problem.exposures))
        left = float(np.mean((u - u.mean()) * (problem.y + u)))
        motion = max(motion, left)
        if left < LEFT * motion:
            return
        fit = solve(problem, (*free, Term(TimingSkew(), per_run=True)))
        gain = np.flatnonzero(fit.design.term == len(free) - 1)
        if not len(gain):
            return
        factor, c, sd = problem.gain, float(fit.theta[gain[0]]), float(fit.sd[gain[0]])
        yield ToldByMeans(((wide, factor * (1 + c), abs(factor) * sd),), _skew(fit, wide))
        wide *= 2


def begun_later(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    uses: tuple[RowUse, ...],
    target: str,
    rows: int,
    model: Model,
) -> Told:
    """Skews of one run by means over so many ``rows`` that begin some rows later."""
    found: list[tuple[int, float, float]] = []
    free = (*(t for t in model if not isinstance(t.effect, TimingSkew)), Term(TimingSkew()))
    for later in (k for k in LATER if k < rows):
        runs = tuple(rows_between(r, later, len(r)) for r in recordings)
        own = tuple(RowUse(use.fit[later:], use.held_out[later:]) for use in uses)
        problem = binned(manifest, runs, own, target, rows)
        found += _skew(solve(problem, free), rows)
    return tuple(found)


def _skew(fit: Fit, rows: int) -> Told:
    """The one skew of a fit by means over so many rows, its last term; nothing where it has none or several."""
    at = np.flatnonzero(fit.design.term == len(fit.model) - 1)
    return ((rows, float(fit.theta[at[0]]), float(fit.sd[at[0]])),) if len(at) == 1 else ()
