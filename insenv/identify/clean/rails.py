"""Rails: the largest or smallest value that a channel can read, at which it clips.

At a rail many rows have exactly one and the same extreme value, many more than the values next to it (a tail of noise
thins out), and what was to be read lies beyond it:

* where the table's rate u is known, the line a + b u through the other rows is beyond the rail in the rows at it, and
  twice as many rows as at the values next to it will do: of a minute of a robot's turns a rail has 17 rows;
* beside a table's rate that is noisy or late the reading stands at the rail while the table moves, for many times
  longer than it stands anywhere else in fast motion, and again longer than there: a logger that loses rows for once
  repeats the value that it had, and in a fast motion that is the largest one;
* where the table's rate is known, a number that goes on from the largest to the smallest one is at the wrong end of the
  range while the table turns beyond the other: an overflow;
* where it is not known, the rows before and after a stretch at the rail head for values beyond it.

A coarse reading that stands still at its highest dwell does neither. Rows at a rail are left out with what lies between
them: where noise reaches the rail now and then, the mean of what is left below it would be too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import robust_deviation
from insenv.core.series.rounding import rounding
from insenv.core.series.stretches import stretches
from insenv.data.cells.table import table_rate_of_rows
from insenv.data.exposure import table_share
from insenv.identify.clean.outliers import leaving_out
from insenv.identify.findings import RejectedRows

Mask = NDArray[np.bool_]

#: Fewest rows at a rail, by how much more than at any of the values next to it, and where the table asks for far more.
FEWEST, PILED, PILED_BEYOND = 8, 5.0, 2.0
#: Fewest rows at the other end of a range whose one end is a rail, where it is as far from zero.
MIRRORED = 2
#: Values next to the extreme one that are looked at, and values of which a channel must have more.
BESIDE, DISTINCT = 5, 24
#: What was to be read is beyond the rail by so many deviations, by so many steps of rounding, by this share of it.
DEVIATIONS, STEPS, SHARE = 3.0, 3.0, 2e-3
#: Share of the range that the table asks for at the other end where a number overflows, in a share of the rows there.
OTHER_END, OVER = 0.9, 0.2
#: Rows that a reading stands at a rail at least, by how much longer than at other values beyond a share of it, and
#: scatter of the table there in that of its white noise.
STANDS, LONGER, FAST, MOVES = 8, 5, 0.7, 1.2
#: Share of the stretches at a rail whose neighbours head beyond it, and stretches that are looked at.
HEADED, LOOKED = 0.5, 500
#: Rows at most over which the approach to a rail is a line.
LONGEST_APPROACH = 64
#: Rows between two at the rail that belong to them if they leave it by less than a share of it; rows on both sides.
BETWEEN, HARDLY, MARGIN = 32, 0.05, 2
#: Largest share of the rows at a rail: a channel that reads little else is dead.
MOST = 0.9


@dataclass(frozen=True)
class Rail:
    """A value at which a target clips.

    Attributes
    ----------
    value : float
        [SI]
    high : bool
        Whether it is the largest value that the target reads, else the smallest.
    step : float
        To which readings are rounded.
    rows : int
        Rows that have exactly this value.
    share : float
        Share of the other rows that repeat the value before them.
    over : bool
        Whether it is read where more than the other end was to be: a number that overflows.
    """

    value: float
    high: bool
    step: float
    rows: int
    share: float
    over: bool = False


def find_rails(recordings: tuple[Recording, ...], target: str) -> tuple[Rail, ...]:
    """Rails of ``target``: none, one or both."""
    values = np.concatenate([r.channels[target].values for r in recordings])
    low, high = (_rail(recordings, target, values, side) for side in (-1.0, 1.0))
    found = low or _mirrored(high, values), high or _mirrored(low, values)
    return tuple(rail for rail in found if rail is not None)


def without_rails(
    recordings: tuple[Recording, ...], target: str, rails: tuple[Rail, ...]
) -> tuple[tuple[Recording, ...], tuple[RejectedRows, ...]]:
    """The recordings with the rows at the rails left out, and those rows."""
    cleaned, rejected = [], []
    for run, recording in enumerate(recordings):
        values = recording.channels[target].values
        mask = np.zeros(len(values), bool)
        for rail in rails:
            near = _near(_at(values, rail.value), values, rail.value)
            reason = f"reads its {'largest' if rail.high else 'smallest'} value"
            reason += " where it would be beyond the other end" if rail.over else ""
            rejected += [RejectedRows(target, run, a, b, reason, "saturation", rail.value) for a, b in stretches(near)]
            mask |= near
        cleaned.append(leaving_out(recording, target, mask) if mask.any() and not mask.all() else recording)
    return tuple(cleaned), tuple(rejected)


def _at(values: Floats, value: float) -> Mask:
    return np.asarray(np.abs(values - value) <= 16 * np.spacing(abs(value)))


def _near(at: Mask, values: Floats, value: float, margin: int = MARGIN) -> Mask:
    """Rows at a rail with those between them that hardly leave it, and ``margin`` on both sides."""
    rows = np.flatnonzero(at)
    near = at.copy()
    for a, b in zip(rows[:-1], rows[1:], strict=True):
        if 1 < b - a <= BETWEEN and np.abs(values[a + 1 : b] - value).max() < HARDLY * abs(value):
            near[a:b] = True
    for a, b in stretches(near):
        near[max(0, a - margin) : b + margin] = True
    return near


def _rail(recordings: tuple[Recording, ...], target: str, values: Floats, side: float) -> Rail | None:
    value = float((side * values).max() * side)
    at = _at(values, value)
    rows = int(at.sum())
    if not FEWEST <= rows <= MOST * len(values):
        return None
    step = max(rounding(r.channels[target].values) for r in recordings)
    if abs(value) < step:
        return None  # what counts nothing at rest, and turns one way alone
    by_table = [_wanted_by_table(r, target, value, side, step) for r in recordings]
    known = [one for one in by_table if one is not None]
    over = any(_overflows(r, target, value, side) for r in recordings)
    alone = over or (not known and _heads_beyond(values, at, value, side, step))
    wanted = PILED if alone else min(known, default=np.inf)
    if not _piled(values[~at], side, rows) > wanted:
        return None
    other = np.diff(values)[~at[1:]]
    return Rail(value, side > 0, step, rows, float(np.mean(other == 0)) if len(other) else 0.0, over)


def _mirrored(rail: Rail | None, values: Floats) -> Rail | None:
    """The rail at the other end, as far from zero, where few rows are at it."""
    end = None if rail is None else float(values.min() if rail.high else values.max())
    if rail is None or end is None or not _at(np.array([end]), -rail.value).any():
        return None
    rows = int(_at(values, end).sum())
    return Rail(end, not rail.high, rail.step, rows, rail.share) if rows >= MIRRORED else None


def _piled(others: Floats, side: float, rows: int) -> float:
    """How many times as many rows are at an end as at the fullest of the values next to it; 0 where few are read."""
    distinct, count = np.unique(others, return_counts=True)
    if len(distinct) < DISTINCT:
        return 0.0
    beside = count[-BESIDE:] if side > 0 else count[:BESIDE]
    return float(rows / beside.max())


def _wanted_by_table(recording: Recording, target: str, value: float, side: float, step: float) -> float | None:
    """How many times as many rows a rail must have as the values next to it, by what the table's rate asks for there.

    None where the table does not tell; infinite where it asks for no more than is read.
    """
    table = table_rate_of_rows(recording, target)
    values = recording.channels[target].values
    at = _at(values, value)
    if table is None or abs(table_share(recording, target)) < 0.1 or not at.any() or at.sum() > len(at) - DISTINCT:
        return None
    u = table * table_share(recording, target)
    # At the other end it may clip too.
    free = ~_at(values, float(values.max())) & ~_at(values, float(values.min()))
    if free.sum() < DISTINCT or np.ptp(u[free]) == 0:
        return None
    line = np.polynomial.Polynomial.fit(u[free], values[free], 1)
    noise = robust_deviation(values[free] - line(u[free]))
    more = float(np.median(side * (line(u[at]) - value)))
    if more > max(DEVIATIONS * noise, STEPS * step, SHARE * abs(value)):
        return PILED_BEYOND if more > STEPS * _between(values[free], side) else PILED
    # Where one row tells nothing of what is asked, all of them do; by less than a row's noise a line may be off.
    beyond = more > noise * max(1.0, DEVIATIONS / np.sqrt(at.sum() / 2))
    return PILED if (beyond or _moves(line(u), at, values)) and _stands(values, at, free, value) else np.inf


def _overflows(recording: Recording, target: str, value: float, side: float) -> bool:
    """Whether an end of the range is read where the table turns beyond the other one."""
    table = table_rate_of_rows(recording, target)
    values = recording.channels[target].values
    at = _at(values, value)
    if table is None or abs(table_share(recording, target)) < 0.1 or at.sum() < FEWEST or (~at).sum() < DISTINCT:
        return False
    u = table * table_share(recording, target)
    if np.ptp(u[~at]) == 0:
        return False
    line = np.polynomial.Polynomial.fit(u[~at], values[~at], 1)
    beyond = OTHER_END * float(np.abs(values).max())
    return float(np.mean(-side * line(u[at]) > beyond)) > OVER


def _between(values: Floats, side: float) -> float:
    """Usual distance of the values that are read next to an end: a step that no exact rounding shows."""
    distinct = np.unique(values)
    return float(np.median(np.diff(distinct[-DISTINCT:] if side > 0 else distinct[:DISTINCT])))


def _moves(asked: Floats, at: Mask, values: Floats) -> bool:
    """Whether what is asked at a rail goes up and down, beyond its own white noise and the steps of the reading."""
    pairs = at[1:] & at[:-1]
    if not pairs.any():
        return False
    whole, white = (
        robust_deviation(asked[at] - np.median(asked[at])),
        robust_deviation(np.diff(asked)[pairs]) / np.sqrt(2),
    )
    steps = np.abs(np.diff(values))
    step = float(np.median(steps[steps > 0])) if np.any(steps > 0) else 0.0
    return whole > MOVES * white and whole**2 - white**2 > step**2


def _stands(values: Floats, at: Mask, free: Mask, value: float) -> bool:
    """Whether a reading stands at a rail far longer than at any other value of fast motion, and longer once more."""
    middle = float(np.median(values))
    fast = free & (np.abs(values - middle) > FAST * abs(value - middle))
    again, longest = sorted([0, 0, *(b - a for a, b in stretches(at))])[-2:]
    same = (np.diff(values) == 0) & fast[1:]
    other = 1 + max((b - a for a, b in stretches(same)), default=0)
    return longest >= max(STANDS, LONGER * other) and again > other


def _heads_beyond(values: Floats, at: Mask, value: float, side: float, step: float) -> bool:
    """Whether the rows before and after the stretches at a rail head for values beyond it."""
    near = stretches(_near(at, values, value, 0))
    headed = []
    for a, b in near[:: max(1, len(near) // LOOKED)]:
        count = int(np.clip((b - a) // 2, 2, LONGEST_APPROACH))
        for rows in (np.arange(a - count, a), np.arange(b + count - 1, b - 1, -1)):
            if rows.min() >= 0 and rows.max() < len(values) and not at[rows].any():
                headed.append(_heads(side * (values[rows] - value), step))
    return len(headed) > 1 and float(np.mean(headed)) >= HEADED


def _heads(below: Floats, step: float) -> bool:
    """Whether values that come to a rail at 0 go on beyond it, half as far as they are long."""
    n = len(below)
    x = np.arange(n) - 0.5 * (n - 1)
    slope = float(x @ below / (x @ x))
    left = below - below.mean() - slope * x
    reach = 1.5 if n == 2 else n - 0.5
    error = float(np.sqrt(left @ left / max(n - 2, 1) * (1 / n + reach**2 / (x @ x)))) if n > 2 else 0.0
    ahead = float(below.mean()) + slope * reach
    return ahead > max(STEPS * step, DEVIATIONS * error)
