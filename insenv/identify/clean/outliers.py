"""Readings that are no measurements: spikes, knocks, dropped words of a data link, values that stick.

**Spikes.** Of the samples less the table's rate, and of their means over 8, 64, ... rows, those that are far off their
neighbours (`insenv.core.series.outlying`).

**Words that were not read.** One number, most often nothing, again and again in rows whose neighbours agree on another.

**Ramps.** Rows in which a table has not yet the rate that it was told (`insenv.identify.clean.ramps`).

**Sticking.** A value that repeats longer than chance allows, where rows with as fast a table hardly ever repeat.

Single bins of a recording at rest are judged once more by themselves (`outliers`).

**Points.** In a list of points the row before is no neighbour. Readings y are laid against what was set,

    y_i = sum_k b_k p_k(x_i) + e_i,     b = arg min sum_i |e_i|

with p_k the powers of a rate or a temperature, the waves of an angle, the axes of an attitude, and the time; one that
is `OFF` robust deviations off is a blunder, a word or a sign that was written wrong, where it is alone. Where others at
the same x, or next to it on either side, are off alike, it is how the instrument is, and so it is at an end of what was
set, where nothing says how the curve goes on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from insenv.core.recording import Floats, Recording
from insenv.core.series.least_absolute import least_absolute
from insenv.core.series.outlying import FAR, MOST, NEIGHBOURS, at_one_angle, far, far_of_many, unseen
from insenv.core.series.robust import robust_deviation
from insenv.core.series.rounding import rounding
from insenv.core.series.stretches import stretches
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.cells.table import table_rate_of_rows
from insenv.data.exposure import input_of_rows, table_share
from insenv.data.reference import ACCELEROMETER_TRIAD, ATTITUDE, is_in_points, points_of
from insenv.identify.clean.ramps import approaching
from insenv.identify.findings import RejectedRows
from insenv.identify.fit.bins import Block
from insenv.identify.fit.problem import Problem

Mask = NDArray[np.bool_]

#: Largest share of the table's rate that is rounding.
ROUNDED_SHARE = 0.05
#: Share of the rows of a run at rest up to which outliers that are too many to be left out are single ones.
SINGLE = 0.15
#: Each scale has so many rows of the one below.
SCALE = 8
#: A gap longer than this many periods parts what is compared.
APART = 20.0
#: Probability that a sound recording has one value that is said to stick.
STICKS_BY_CHANCE = 1e-4
#: Fewest equal values in a row that may stick; share of repeats from which values are too coarse to tell.
FEWEST_EQUAL, COARSE = 5, 0.2
#: Groups of rows by the size of the table's rate: a gyro near lock-in repeats itself, and only there.
RATE_GROUPS = 16
#: Fewest rows that were not read, and share of all that are far off which read the same number; most of them one after
#: the other, share of the run that they may be, and robust deviations by which a row with that number is one of them.
FEWEST_UNREAD, ONE_NUMBER, MOST_UNREAD, SHARE_UNREAD, SURELY = 5, 0.4, 4, 0.25, 4.0
#: Robust deviations by which a point is off: of 11 to 80 points in ten thousand lists without a blunder 1 to 8 has one.
OFF = 10.0
#: Points for each column of their curve, and most columns; points for each that may be off.
EACH, MOST_COLUMNS, ALONE = 4, 6, 20
#: Share of the range of what was set within which points are at one place, and of a deviation that is off alike.
SAME, ALIKE = 0.005, 0.3


def without_outliers(
    recordings: tuple[Recording, ...], target: str, longest: int
) -> tuple[tuple[Recording, ...], tuple[RejectedRows, ...]]:
    """The recordings with outlying rows of ``target`` left out, and those rows.

    Parameters
    ----------
    recordings : tuple of Recording
    target : str
    longest : int
        Rows of the longest means that are looked at.
    """
    cleaned, rejected = [], []
    for run, recording in enumerate(recordings):
        found = _of_run(recording, target, run, longest)
        mask = np.zeros(len(recording), bool)
        for one in found:
            mask[one.start : one.stop] = True
        if mask.any():
            recording = leaving_out(recording, target, mask)
        cleaned.append(recording)
        rejected += found
    return tuple(cleaned), tuple(rejected)


def too_many(recordings: tuple[Recording, ...], target: str, rejected: tuple[RejectedRows, ...]) -> tuple[str, ...]:
    """A reason where single rows of a run at rest are far off their neighbours, and too many to be left out.

    They are in the fit as noise, which knows nothing of them. Rows that are ``rejected`` are not asked.
    """
    said = []
    for run, recording in enumerate(recordings):
        sound = np.ones(len(recording), bool) if recording.unused is None else ~recording.unused
        for one in rejected:
            if one.run == run:
                sound[one.start : one.stop] = False
        follow = table_rate_of_rows(recording, target) is None and not is_in_points(recording)
        if not follow or sound.sum() < 4 * NEIGHBOURS:
            continue
        values = recording.channels[target].values[sound]
        away = far_of_many(values, rounding(values))
        hit = away > 1
        if MOST < hit.mean() <= SINGLE:
            least, most = FAR * float(away[hit].min()), min(FAR * float(away[hit].max()), 999.0)
            said.append(
                f"{hit.sum()} of {len(values)} rows are {least:.0f} to {most:.0f} robust deviations off their "
                "neighbours: too many to be left out, and no noise term has them"
            )
    return tuple(said)


def leaving_out(recording: Recording, target: str, mask: Mask) -> Recording:
    """The recording without some rows of ``target``; in its samples their neighbours' line stands for them."""
    channel, row = recording.channels[target], np.arange(len(recording))
    mask = mask | recording.left_out.get(target, np.zeros(len(recording), bool))
    table = input_of_rows(recording, target)
    follows = np.zeros(len(recording)) if table is None else table
    level = np.interp(row, row[~mask], (channel.values - follows)[~mask])
    values = np.where(mask, level + np.interp(row, row[~mask], follows[~mask]), channel.values)
    channels = {**recording.channels, target: replace(channel, values=values)}
    left_out = {**recording.left_out, target: mask | recording.left_out.get(target, False)}
    return replace(recording, channels=channels, left_out=left_out)


def _of_run(recording: Recording, target: str, run: int, longest: int) -> list[RejectedRows]:
    if is_in_points(recording):
        return blunders(recording, target, run)
    y = recording.channels[target].values
    table = input_of_rows(recording, target)
    u = np.zeros(len(y)) if table is None else table
    before = recording.left_out.get(target, np.zeros(len(y), bool))
    unread = _unread(y) & ~before
    stuck = _stuck(y, u) & ~before & ~unread
    found = [RejectedRows(target, run, a, b, f"{b - a} equal values", "stuck") for a, b in stretches(stuck)]
    found += [
        RejectedRows(target, run, a, b, f"{y[a]:.3g} {recording.channels[target].unit} between others: not read")
        for a, b in stretches(unread)
    ]
    ramps = approaching(recording, target, run)
    found += ramps
    for ramp in ramps:
        stuck[ramp.start : ramp.stop] = True
    stuck |= unread
    coarse = _rounding(recording, target)
    spikes, sizes = _spikes(recording, y - u, u, stuck, longest, (coarse, rounding(y)))
    if table is not None:
        spikes |= _reference_spikes(y, u, sizes, coarse)
    angle = recording.channels.get("table_angle")
    used = slice(None) if recording.unused is None else ~recording.unused
    if spikes[used].mean() > MOST or (angle is not None and at_one_angle(angle.values, spikes)):
        return found
    for a, b in stretches(spikes & ~stuck & ~before):
        size = min(float(sizes[a:b].max()), 999.0)
        more = "more than " if size == 999 else ""
        found.append(RejectedRows(target, run, a, b, f"{more}{size:.0f} robust deviations off its neighbours"))
    return sorted(found, key=lambda one: one.start)


def blunders(recording: Recording, target: str, run: int) -> list[RejectedRows]:
    """Rows of a list of points that are off the curve of the others, and alone.

    Source: P. J. Huber, Robust Statistics (1981), section 7 (least absolute deviations are not pulled).

    Parameters
    ----------
    recording : Recording
        Of which each row is a point (`insenv.data.reference.points_of`).
    target : str
    run : int
        Number of the run, counted from 0.
    """
    name = points_of(recording)
    if name is None or (name == ATTITUDE and target.startswith("accel")) or not _law(recording, name):
        return []
    columns, y = _curve(recording, name), recording.channels[target].values
    if columns.shape[1] < 2:
        return []
    left = least_absolute(columns, y)[1]
    scale = robust_deviation(np.sort(np.abs(left))[columns.shape[1] :])
    off = np.flatnonzero(np.abs(left) > OFF * scale)
    if not scale or len(off) > max(1, len(y) // ALONE):
        return []
    return [
        RejectedRows(
            target, run, i, i + 1, f"{min(abs(left[i]) / scale, 999):.0f} robust deviations off the other points"
        )
        for i in off.tolist()
        if _is_alone(recording, name, left, i)
    ]


def _curve(recording: Recording, name: str) -> Floats:
    """Columns that a law of the points may have, as many as the points allow, the plainest first: shape (n, k)."""
    n = len(recording)
    law = _law(recording, name)
    beside = ["temperature"] if name != "temperature" and "temperature" in recording.channels else []
    plain = [column for column in (*(recording.channels[one].values for one in beside), recording.t) if np.ptp(column)]
    slow = [(column - column.mean()) / np.ptp(column) for column in plain]
    first = 3 if name == ATTITUDE else 2
    columns = [np.ones(n), *law[:first], *slow, *law[first:]]
    return np.column_stack(columns[: min(MOST_COLUMNS, n // EACH)])


def _law(recording: Recording, name: str) -> list[Floats]:
    """Columns of what the points were set to; none where that is the same in all of them."""
    if name == ATTITUDE:
        return [recording.channels[axis].values / STANDARD_GRAVITY for axis in ACCELEROMETER_TRIAD]
    x = recording.channels[name].values
    if name == "table_angle":
        return [wave(order * x) for order in (1, 2) for wave in (np.cos, np.sin)]
    if not np.ptp(x):
        return []
    s = (x - x.mean()) / np.ptp(x)
    return [s, s**2, s**3]


def _is_alone(recording: Recording, name: str, left: Floats, i: int) -> bool:
    """Whether no point at the same place, or next to it, is off alike, and the curve goes on on both sides."""
    at = np.column_stack(_law(recording, name)[: {ATTITUDE: 3, "table_angle": 2}.get(name, 1)])
    there = np.linalg.norm(at - at[i], axis=1) <= SAME * float(np.max(np.ptp(at, axis=0)))
    there[i] = False
    if there.any():
        return not bool(np.any(left[there] / left[i] > ALIKE))
    if name == ATTITUDE:
        return True  # of which no two are next to each other
    x = recording.channels[name].values if name != "table_angle" else np.mod(recording.channels[name].values, 2 * np.pi)
    if name == "table_rate" and abs(x[i]) == np.abs(x[x != 0]).min(initial=np.inf):
        return False  # a dead band and a lock-in show at the slowest rate alone
    places = np.unique(x)
    place = int(np.searchsorted(places, x[i]))
    if name != "table_angle" and place in (0, len(places) - 1):
        return False
    beside = np.isin(x, (places[place - 1], places[(place + 1) % len(places)]))
    return not bool(np.any(left[beside] / left[i] > ALIKE))


def _rounding(recording: Recording, target: str) -> float:
    """What rounding of the reference alone may move one row of the target less the table's rate by.

    Steps that are a good part of the rate itself are how the table moves.
    """
    if "table_angle" in recording.channels:
        angle = recording.channels["table_angle"].values
        least = rounding(angle)
        if _goes_by_whole_steps(angle, least):
            return 0.0
        step, most = least / recording.dt, float(np.abs(np.diff(angle)).max(initial=0.0)) / recording.dt
    elif "table_rate" in recording.channels:
        rate = recording.channels["table_rate"].values
        step, most = rounding(rate), float(np.abs(rate).max(initial=0.0))
    else:
        return 0.0
    return abs(table_share(recording, target)) * step if step < ROUNDED_SHARE * most else 0.0


def _goes_by_whole_steps(angle: Floats, step: float) -> bool:
    """Whether a table was moved by whole steps of its angle from row to row, so that nothing was rounded.

    Of a rounded one a row has a step more or less than those beside it now and then.
    """
    if not step:
        return False
    moved = np.rint(np.diff(angle) / step)
    hops = np.abs(moved[1:-1] - moved[:-2]) == 1
    return bool(np.any(moved)) and not bool(np.any(hops & (moved[2:] == moved[:-2])))


def _spikes(
    recording: Recording, x: Floats, u: Floats, stuck: Mask, longest: int, steps: tuple[float, float]
) -> tuple[Mask, Floats]:
    """Outlying rows at every scale, and by how many deviations; rows that stick are not asked.

    ``steps`` are those of the reference, which cancel from row to row, and of the target, which add up as chance does:
    of a counter at a rate of whole counts a row one count more is none.
    """
    mask, sizes = np.zeros(len(x), bool), np.zeros(len(x))
    breaks = np.flatnonzero(np.diff(recording.t) > APART * recording.dt) + 1
    for piece in np.split(np.arange(len(x)), breaks):
        rows = piece[~stuck[piece]]
        scale = 1
        while scale <= longest and len(rows) // scale >= 4 * NEIGHBOURS:
            kept = rows[: len(rows) // scale * scale].reshape(-1, scale)
            coarse = max(steps[0] / scale, steps[1] / np.sqrt(scale))
            away = far(x[kept].mean(axis=1), u[kept].max(axis=1), u[kept].min(axis=1), coarse)
            hit = np.flatnonzero(away > 1)
            # Slower than rows a knock is not even: what is beside it on this scale belongs to it.
            mask[kept[hit]] = True
            sizes[kept[hit]] = np.maximum(sizes[kept[hit]], FAR * away[hit][:, None])
            rows = rows[~mask[rows]]
            scale *= SCALE
    return mask, sizes


def _reference_spikes(y: Floats, u: Floats, sizes: Floats, coarse: float) -> Mask:
    """Rows in which the table's rate leaps away and back and the instrument has seen nothing of it: a wrong angle."""
    hit, away = unseen(y, u, coarse)
    sizes[hit] = np.maximum(sizes[hit], FAR * away[hit])
    return hit


def _unread(y: Floats) -> Mask:
    """Rows that read one and the same number, far off what the rows before and after agree on.

    None of a reading of few numbers, as a counter's, which hops from one to the next and back.
    """
    mask = np.zeros(len(y), bool)
    if len(y) < 4 * NEIGHBOURS or np.mean(np.diff(y) == 0) > COARSE:
        return mask
    off = y[1:-1] - 0.5 * (y[:-2] + y[2:])
    hops = np.abs(np.diff(y))
    usual = float(np.median(hops[hops > 0])) if hops.any() else 0.0
    scale = max(robust_deviation(off), rounding(y), usual / FAR)
    far_off = 1 + np.flatnonzero((np.abs(off) > FAR * scale) & (np.abs(y[2:] - y[:-2]) < np.abs(off)))
    if not scale or len(far_off) < FEWEST_UNREAD:
        return mask
    numbers, count = np.unique(y[far_off], return_counts=True)
    number = float(numbers[count.argmax()])
    at = y == number
    if count.max() < max(FEWEST_UNREAD, ONE_NUMBER * len(far_off)) or at.all():
        return mask
    rows = np.arange(len(y))
    away = np.abs(np.interp(rows, rows[~at], y[~at]) - number)
    for a, b in stretches(at):
        mask[a:b] = b - a <= MOST_UNREAD and bool(away[a:b].min() > SURELY * scale)
    return mask if mask.sum() >= FEWEST_UNREAD and mask.mean() <= SHARE_UNREAD else np.zeros(len(y), bool)


def _stuck(y: Floats, u: Floats) -> Mask:
    """Rows whose value repeats longer than chance allows."""
    same = np.diff(y) == 0
    mask = np.zeros(len(y), bool)
    if not same.any() or same.mean() > COARSE:
        return mask
    repeats = np.full(len(same), same.mean())
    if np.ptp(u) > 0:
        group = np.minimum(np.argsort(np.argsort(np.abs(u[1:]))) * RATE_GROUPS // len(same), RATE_GROUPS - 1)
        share = np.bincount(group, weights=same, minlength=RATE_GROUPS) / np.bincount(group, minlength=RATE_GROUPS)
        repeats = share[group]
    chance = np.concatenate([[0.0], np.cumsum(np.log(np.maximum(repeats, 1 / len(same))))])
    for a, b in stretches(same):
        equal = b - a + 1
        if equal >= FEWEST_EQUAL and chance[b] - chance[a] < np.log(STICKS_BY_CHANCE / len(y)):
            mask[a + 1 : b + 1] = True
    return mask


def rows_of_bins(problem: Problem) -> tuple[RejectedRows, ...]:
    """Rows of the bins that are left free as outliers."""
    reason = f"a mean over {problem.bins.width:.3g} s off its neighbours"
    each = (problem.rows_in(np.arange(problem.bins.n) == index) for index in problem.outliers)
    return tuple(
        RejectedRows(problem.target, run, int(rows[0]), int(rows[-1]) + 1, reason)
        for found in each
        for run, rows in found.items()
    )


def outliers(y: Floats, blocks: tuple[Block, ...]) -> tuple[int, ...]:
    """Indices of outlying bins of the fitted blocks."""
    found: list[int] = []
    for block in blocks:
        if not block.fitted or block.n < 4 * NEIGHBOURS:
            continue
        x = y[block.start : block.stop]
        left = x - median_filter(x, size=NEIGHBOURS, mode="reflect")
        scale = robust_deviation(left - np.median(left))
        if scale > 0:
            found += (block.start + np.flatnonzero(np.abs(left) > FAR * scale)).tolist()
    fitted = sum(b.n for b in blocks if b.fitted)
    return tuple(found) if len(found) <= MOST * fitted else ()
