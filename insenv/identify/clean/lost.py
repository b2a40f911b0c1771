r"""Where a measured reference lost the motion: cameras that no longer saw their markers, a wheel that slid.

    z = < y - g u(t - tau) >_m - median,      < >_m means over the rows at which the gain has settled

A second of it may hold three quarters of the square sum of all that is left, and leads the fit. It is an event where z
is beyond 8 robust deviations of what is left while the table moves **no faster than there**: rows in eight groups by
the largest rate within a second, and the scatter of the loudest group up to its own; and 5 times as large as what is
usual in the whole run. What an instrument does at one rate, or in proportion to it, makes the scatter of a group, and
no event. Nor is one what lasts more than 3 s, or is more than a tenth of the run: that is how the instrument or the
reference is. Nor what is there, a quarter as far off and more, most times that the table changes its rate as fast, or
turns round: a play shows there alone, and a skew in ramps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import MEDIAN
from insenv.core.series.stretches import stretches
from insenv.data.exposure import expose
from insenv.identify.clean.doubtful import Settled
from insenv.identify.clean.response.stretches import Stretch
from insenv.identify.findings import RejectedRows

#: Deviations from which on there is an event, and up to which it lasts; the same in what is usual in the run.
FAR, NEAR, LEADS = 8.0, 3.0, 5.0
#: Groups of rows by the size of the rate within so long [s], shortest and longest mean, longest event [s], share of a
#: run beyond which there is none.
GROUPS, AROUND, SHORTEST, WIDEST, LONGEST, MOST = 8, 1.0, 0.3, 0.64, 3.0, 0.1
#: Share of the loudest group's scatter that is none; times the usual rate of a group beyond which its scatter is taken
#: to grow with the rate, as what an instrument makes of it does: of the fastest rows few are as fast as the fastest.
ROUNDING, FASTER = 1e-3, 2.0
#: Share of an event's fastest change of the rate from which on another change is like it, share of the largest rate
#: beyond which a table has turned round; share of its deviations that others have then, and share of the others.
LIKE, ROUND, COMPARES, EACH = 0.5, 0.02, 0.25, 0.7


def lost_rows(recordings: tuple[Recording, ...], target: str, settled: tuple[Settled, ...]) -> tuple[RejectedRows, ...]:
    """Rows of ``target`` where its reference lost the motion, of runs whose gain and lag are told."""
    found: list[RejectedRows] = []
    for one in settled:
        found += _of_run(recordings[one.run], target, one)
    return tuple(found)


def _spread(y: Floats, u: Floats, left: Floats, known: NDArray[np.bool_], around: int) -> Floats:
    """Robust deviation of what is left in rows about which the table moves no faster, shape (n,)."""
    size = maximum_filter1d(np.where(known, np.maximum(np.abs(y), np.abs(u)), 0.0), around)
    spread = np.full(len(y), np.inf)
    groups = np.array_split(np.flatnonzero(known)[np.argsort(size[known])], GROUPS)
    own = np.array([float(np.median(np.abs(left[group]))) / MEDIAN for group in groups])
    # Rounded rows at rest scatter by nothing, which tells nothing of any motion: the next group's holds for them.
    loud = own > ROUNDING * own.max()
    loudest = np.maximum.accumulate(np.where(loud, own, own[loud].min(initial=np.inf)))
    for group, deviation in zip(groups, loudest, strict=True):
        usual = max(float(np.median(size[group])), 1e-300)
        spread[group] = deviation * np.maximum(1.0, size[group] / (FASTER * usual))
    return spread


def _as_others(y: Floats, score: Floats, event: slice, over: int) -> bool:
    """Whether most changes of the rate that are like an event's have what it has; readings ``y`` tell them, shape (n,).

    The reference is not asked: what it lost is a change of its own.
    """
    row = np.arange(len(y))
    later, before = y[np.minimum(row + over, len(y) - 1)], y[np.maximum(row - over, 0)]
    change, least = np.abs(later - before), ROUND * float(np.abs(y).max(initial=0.0))

    def turns_round(part: slice) -> bool:
        return float(y[part].min()) < -least and float(y[part].max()) > least

    round_ = turns_round(event)
    fast = (change >= LIKE * change[event].max()).astype(np.int8)
    alike = np.asarray(minimum_filter1d(maximum_filter1d(fast, over), over)) > 0
    alike[event] = True
    parts = [slice(max(a - over // 2, 0), b + over // 2) for a, b in stretches(alike)]
    as_far = max(NEAR, COMPARES * float(score[event].max()))
    like = [float(score[part].max()) > as_far for part in parts if not round_ or turns_round(part)]
    return len(like) > 1 and float(np.mean(like)) >= EACH


def _of_run(recording: Recording, target: str, told: Settled) -> list[RejectedRows]:
    exposure = expose(recording, target)
    n, dt = len(exposure.y), exposure.motion.dt
    over = max(min(told.over, round(WIDEST / dt)), round(SHORTEST / dt), 1)
    if n < GROUPS * over:
        return []
    means = Stretch(told.run, exposure, 0, n, over=over)
    # A mean knows what its empty cells would hold by the rows around them.
    row, there = np.arange(n), exposure.count > 0
    filled = replace(exposure, y=np.interp(row, row[there], exposure.y[there]))
    y, u = replace(means, exposure=filled).y, told.gain * means.input(told.lag)
    known = means.known > 0
    if known.sum() < GROUPS * over:
        return []
    y = y - np.median((y - u)[known])  # a bias is no rate of turn
    left = y - u
    # Near an end a mean is of fewer rows, and the rounding of an angle in it as much larger.
    fewer = np.minimum(1.0, (np.minimum(row, n - 1 - row) + 1 + over // 2) / over)
    score = np.where(known, fewer * np.abs(left) / _spread(y, u, left, known, max(round(AROUND / dt), 1)), 0.0)
    calm = known & (score < FAR)
    usual = float(np.sqrt(np.mean(left[calm] ** 2))) if calm.any() else 0.0
    far = np.zeros(n)  # of the event that a cell is part of: at its ends a mean is less far off
    # What was lost is made good at once or later, with the other sign: one event.
    for a, b in stretches(np.asarray(maximum_filter1d(score, 2 * over + 1)) > NEAR):
        brief = b - a - 2 * over <= LONGEST / exposure.motion.dt
        leads = score[a:b].max() > FAR and np.abs(left[a:b]).max() > LEADS * usual
        if brief and leads and not _as_others(y, score, slice(a, b), over):
            # An event that reaches an end of the run has nothing sound beyond; means of less there hold the end often.
            whole = b - a > 2 * over
            reach = slice(0 if whole and not a else a + over // 2, n if whole and b == n else b - over // 2)
            far[reach] = score[a:b].max()
    cells = far > 0
    if cells[there].mean() > MOST:
        return []
    rows = (exposure.cell_of_row >= 0) & cells[exposure.cell_of_row]
    found = []
    for a, b in stretches(rows):
        most = float(far[exposure.cell_of_row[a:b]].max())
        reason = f"{min(most, 999):.0f} robust deviations off the motion that the reference tells"
        found.append(RejectedRows(target, told.run, a, b, reason))
    return found
