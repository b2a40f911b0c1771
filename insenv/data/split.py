"""Which rows may be fitted and which are held out: ``fit`` and ``held_out`` have no row in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Recording, rows_between
from insenv.data.manifest import Manifest, RowRanges
from insenv.data.reference import (
    ACCELEROMETER_TRIAD,
    ATTITUDE,
    OF_POINTS,
    points_of,
    with_positions,
)

Mask = NDArray[np.bool_]

#: Share of each run's time that is held out where the manifest names nothing.
HELD_OUT_SHARE = 0.4
#: Of points one in so many is held out, each so much of that further on than the one before; share of the range of what
#: was set within which it is the same.
EVERY, GOLDEN, ALIKE = 3, (5**0.5 - 1) / 2, 0.02
#: Shares of the time between which the other folds hold rows out: the first of it, and its middle.
_OTHER_FOLDS = ((0.0, HELD_OUT_SHARE), ((1 - HELD_OUT_SHARE) / 2, (1 + HELD_OUT_SHARE) / 2))
#: Share of what a table turned, below which the rows before tell next to nothing of a gain.
LEAST_TURNED = 0.05
#: Parts of a run whose turns are summed: fine enough for swings, and noise of a reading averages within them.
_PARTS = 1000
#: Least share of a run's rows that is held out behind a share of its motion.
_LEAST_HELD = 0.05


@dataclass(frozen=True)
class RowUse:
    """Rows of one run: ``fit`` and ``held_out``, each shape (n,); a row may be in neither, never in both."""

    fit: Mask
    held_out: Mask


def split(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[RowUse, ...]:
    """Use of every row, one `RowUse` per run.

    Raises
    ------
    InputError
        If a row is in both, either is empty, or the manifest names rows that are not there.
    """
    lengths = [len(recording) for recording in recordings]
    if manifest.fit_rows and manifest.held_out.names_nothing:
        fit, held_out = _parted(manifest, recordings)
    else:
        held_out = _held_out(manifest, recordings)
        fit = ~held_out
        if manifest.fit_rows:
            fit = _rows(manifest.fit_rows, recordings, f"{manifest.path}: fit.rows")
    if both := int(np.sum(fit & held_out)):
        first = int(np.argmax(fit & held_out))
        raise InputError(
            f"{manifest.path}: {both} rows from row {first} on are in fit.rows and held out "
            f"({_name(manifest)}); wanted no row in both"
        )
    if not held_out.any():
        raise InputError(f"{manifest.path}: no row is held out ({_name(manifest)}); wanted at least one")
    if not fit.any():
        raise InputError(f"{manifest.path}: every row is held out ({_name(manifest)}); wanted rows to fit")
    edges = np.cumsum(lengths)[:-1]
    return tuple(RowUse(f, h) for f, h in zip(np.split(fit, edges), np.split(held_out, edges), strict=True))


def other_folds(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[tuple[RowUse, ...], ...]:
    """Uses of every row with the first rows of each run held out, and with those in its middle.

    As many are held out as by `split`, by the time or by the motion as there. None where the manifest names rows, nor
    of points.
    """
    if _names_rows(manifest) or _in_points(recordings):
        return ()
    at = _at_share(manifest, recordings)
    folds = []
    for first, last in _OTHER_FOLDS:
        held_out = [(r.t > at(r, first)) & (r.t <= at(r, last)) if first else r.t <= at(r, last) for r in recordings]
        folds.append(tuple(RowUse(~held, held) for held in held_out))
    return tuple(folds)


def with_uses(recordings: Sequence[Recording], uses: Sequence[RowUse]) -> tuple[Recording, ...]:
    """The runs with it said which rows are neither fitted nor held out: whatever happens there decides nothing."""
    unused = (~(use.fit | use.held_out) for use in uses)
    return tuple(replace(r, unused=rows) if rows.any() else r for r, rows in zip(recordings, unused, strict=True))


def without_tails(
    recordings: Sequence[Recording], uses: Sequence[RowUse]
) -> tuple[tuple[Recording, ...], tuple[RowUse, ...]]:
    """The runs, and their uses, up to the last row of each that is fitted or held out.

    What comes after it, as a rocket's flight after its rest on the pad, tells nothing of the rows in use: a rail that
    is reached there clips none of them. What comes before them stays, for time counts from a run's first row.
    """
    ends = [int(np.flatnonzero(use.fit | use.held_out).max(initial=-1)) + 1 for use in uses]
    cut = [end >= 2 for end in ends]
    runs = tuple(rows_between(r, 0, end) if short else r for r, end, short in zip(recordings, ends, cut, strict=True))
    kept = [RowUse(u.fit[:n], u.held_out[:n]) if short else u for u, n, short in zip(uses, ends, cut, strict=True)]
    return runs, tuple(kept)


def _parted(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[Mask, Mask]:
    """Of the rows that fit.rows names the first ones of each run, and the last `HELD_OUT_SHARE` of them.

    Who names rows and nothing to hold out names those that are good: what is between or behind them is neither.
    """
    named = _rows(manifest.fit_rows, recordings, f"{manifest.path}: fit.rows")
    held_out = np.zeros(len(named), dtype=bool)
    lengths = [len(recording) for recording in recordings]
    for start, length in zip(np.cumsum([0, *lengths[:-1]]), lengths, strict=True):
        rows = start + np.flatnonzero(named[start : start + length])
        held_out[rows[int(np.ceil((1 - HELD_OUT_SHARE) * len(rows))) :]] = True
    return named & ~held_out, held_out


def _held_out(manifest: Manifest, recordings: Sequence[Recording]) -> Mask:
    """Held-out rows of all runs in order."""
    named = manifest.held_out
    if named.positions is not None:
        if manifest.procedure != "multi-position":
            raise InputError(f"{manifest.path}: held_out.positions needs model.procedure = 'multi-position'")
        raise InputError(f"{manifest.path}: held_out.positions names rests, not rows; wanted rows or runs")
    if named.rows:
        return _rows(named.rows, recordings, f"{manifest.path}: held_out.rows")
    if named.runs:
        if (last := max(named.runs)) > len(recordings):
            found = f"held_out.runs has {last}; there are {len(recordings)} runs"
            raise InputError(f"{manifest.path}: {found}, each power-up one; wanted one of them")
        whole = [np.full(len(r), number in named.runs) for number, r in enumerate(recordings, start=1)]
        return np.concatenate(whole)
    if named.start is not None:
        return np.concatenate([r.t - r.t[0] >= named.start for r in recordings])
    if _in_points(recordings):
        return np.concatenate([_one_of_each(r) for r in recordings])
    at = _at_share(manifest, recordings)
    return np.concatenate([r.t > at(r, 1 - HELD_OUT_SHARE) for r in recordings])


def _one_of_each(recording: Recording) -> Mask:
    """One of each `EVERY` points, shape (n,), in the order of what was set, and of the time where that is the same.

    Of what comes three times once, in whatever order it comes: of six faces that are gone through again and again, each
    third row would be the same two. Which one of three it is goes on by a step that comes round with nothing.
    """
    place = np.empty(len(recording), int)
    place[np.lexsort(_set_to(recording)[::-1])] = np.arange(len(recording))
    step = np.mod((place // EVERY + 1) * GOLDEN, 1.0)
    return np.asarray(place % EVERY == np.floor(EVERY * step).astype(int))


def _set_to(recording: Recording) -> list[NDArray[np.float64]]:
    """What the points were set to, in steps of `ALIKE` of its range: what is read of it is never twice the same."""
    name = _points_of(recording)
    names = ACCELEROMETER_TRIAD if name == ATTITUDE else (name,)
    values = np.array([recording.channels[one].values for one in names if one is not None])
    if name == "table_angle":
        values = np.mod(values + ALIKE, 2 * np.pi)
    step = ALIKE * max(float(np.ptp(values)), 1e-300)
    return list(np.rint(values / step))


def _names_rows(manifest: Manifest) -> bool:
    """Whether the manifest says which rows are fitted, or which are held out."""
    return bool(manifest.fit_rows) or not manifest.held_out.names_nothing


def _at_share(manifest: Manifest, recordings: Sequence[Recording]) -> Callable[[Recording, float], float]:
    """By what a share of a run is counted where the manifest names no rows: its time, or its motion."""
    return _at_share_of_motion if stands_first(manifest, recordings) else _at_share_of_time


def _in_points(recordings: Sequence[Recording]) -> bool:
    """Whether all rows are points at one rate, angle or temperature each: a staircase ends at one of its extremes."""
    return all(_points_of(r) for r in recordings)


def _points_of(recording: Recording) -> str | None:
    """What each row is a point of, also in a recording that was not read from a file."""
    return points_of(with_positions(recording))


def stands_first(manifest: Manifest, recordings: Sequence[Recording]) -> bool:
    """Whether the rows that nothing but time would give to the fit hold next to none of what the table turned.

    So a robot waits before it drives: the gain would be asked of rows at rest and put to all of the motion. The rows
    are parted by the motion then, at the same share of it.
    """
    if _names_rows(manifest) or manifest.procedure == "multi-position":
        return False
    fitted, whole = 0.0, 0.0
    for recording in recordings:
        edges, turned = _turned(recording)
        fitted += float(np.interp(_at_share_of_time(recording, 1 - HELD_OUT_SHARE), edges, turned))
        whole += float(turned[-1])
        if whole and np.mean(recording.t > _at_share_of_motion(recording, 1 - HELD_OUT_SHARE)) < _LEAST_HELD:
            return False
    return fitted < LEAST_TURNED * whole


def sentence_of_split(manifest: Manifest, recordings: Sequence[Recording]) -> tuple[str, ...]:
    """What to say where rows were not parted by the time."""
    if not _names_rows(manifest) and _in_points(recordings):
        (what, *others) = {OF_POINTS[name] for r in recordings if (name := _points_of(r))}
        return (
            f"each row is a point at one {what if not others else 'state'}: one in {EVERY} is held out, and not the "
            f"last {100 * HELD_OUT_SHARE:.0f} % of the time. [held_out] can name other rows",
        )
    if not stands_first(manifest, recordings):
        return ()
    share = f"{100 * HELD_OUT_SHARE:.0f} %"
    return (
        f"the table turns behind the first {100 * (1 - HELD_OUT_SHARE):.0f} % of the time: not the last {share} of the "
        f"time are held out but the last {share} of what it turns. [held_out] can name other rows",
    )


def _at_share_of_time(recording: Recording, share: float) -> float:
    return float(recording.t[0] + share * (recording.t[-1] - recording.t[0]))


def _at_share_of_motion(recording: Recording, share: float) -> float:
    """Time at which the table has turned a share of what it turns; of one at rest by the time."""
    edges, turned = _turned(recording)
    if not turned[-1]:
        return _at_share_of_time(recording, share)
    return float(np.interp(share * turned[-1], turned, edges))


def _turned(recording: Recording) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times, and how far the table has turned until then, to and fro [rad]: shapes (parts + 1,) each."""
    t = recording.t
    edges = np.linspace(t[0], t[-1], min(_PARTS, max(len(t) - 1, 1)) + 1)
    if (angle := recording.channels.get("table_angle")) is not None:
        stands = np.interp(edges, t, angle.values)
    elif (rate := recording.channels.get("table_rate")) is not None:
        stands = np.interp(edges, t, np.append(0.0, np.cumsum(rate.values[1:] * np.diff(t))))
    else:
        stands = np.zeros(len(edges))
    return edges, np.append(0.0, np.cumsum(np.abs(np.diff(stands))))


def _rows(ranges: RowRanges, recordings: Sequence[Recording], where: str) -> Mask:
    """Mask of all rows that is true in the half-open ``ranges``: of means, where all rows that they hold are."""
    made_of = [r.made_of for r in recordings if r.made_of is not None]
    if len(made_of) == len(recordings):
        whole = np.concatenate(made_of)
        # Behind the last whole mean a file goes on by less than one.
        of_file = _mask(ranges, int(whole.max(initial=0) + np.diff(whole).max(initial=0)), where)
        within = np.append(0, np.cumsum(of_file))[whole]
        return np.diff(within)[:, 0] == np.diff(whole)[:, 0]
    return _mask(ranges, sum(map(len, recordings)), where)


def _mask(ranges: RowRanges, n: int, where: str) -> Mask:
    """Mask of ``n`` rows that is true in the half-open ``ranges``."""
    mask = np.zeros(n, dtype=bool)
    for start, stop in ranges:
        if stop > n:
            raise InputError(f"{where} has [{start}, {stop}]; there are {n} rows, wanted at most [{start}, {n}]")
        mask[start:stop] = True
    return mask


def _name(manifest: Manifest) -> str:
    """How the manifest names what is held out."""
    named = manifest.held_out
    if named.runs:
        return f"held_out.runs = {list(named.runs)}"
    if named.rows:
        return f"held_out.rows = {[list(r) for r in named.rows]}"
    if named.start is not None:
        return f"held_out.start = {named.start:g} s"
    if manifest.fit_rows:
        return f"no [held_out]: the last {100 * HELD_OUT_SHARE:.0f} % of the rows of fit.rows"
    return f"no [held_out]: the last {100 * HELD_OUT_SHARE:.0f} % of the time"
