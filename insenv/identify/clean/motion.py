"""A unit that is declared at rest and moves: rows in which it was turned, driven or tipped are no rest.

Means over a second that leave the median of the recording (`insenv.core.series.moving`), which no bias and no sway
does, are motion that the declared procedure knows nothing of: taken for the instrument's error it would be named a
step, a warm-up or a cross-coupling. A base that heaves or swings leaves the median by less, and comes back: there the
means over a second scatter within `WINDOW` as they do nowhere in the quieter part, for `LASTS` and longer. Such rows
are left out and said; a recording that has little else is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.core.series.moving import BESIDE, LEAST_REST, SECOND, TIPPED, TURNING, departs, rows_of_a_second
from insenv.core.series.stretches import stretches
from insenv.core.units import DEG
from insenv.data.exposure import has_table
from insenv.data.manifest.spec import Manifest
from insenv.data.reference import is_in_points
from insenv.data.split import RowUse
from insenv.identify.findings import RejectedRows

#: Scatter of such means within a window that is a swing [rad/s, m/s^2], at least so many times that of quiet windows.
SWINGS, SWAYS, LOUDER = 1 * DEG, 0.05, 8.0
#: Share of the windows that are quiet.
QUIET = 0.2
#: Length of these windows, and of the shortest swing [s].
WINDOW, LASTS = 5.0, 10.0
#: Why such rows are left out.
REASON = "motion"


def at_rest(
    manifest: Manifest, recordings: tuple[Recording, ...], uses: tuple[RowUse, ...], target: str
) -> tuple[tuple[RowUse, ...], tuple[RejectedRows, ...]]:
    """The uses of the rows of ``target`` without those in which it moves, and these rows.

    As they are where the procedure knows of motion: a table, a triad that turns about a known axis. A gyro is judged by
    itself, for it may stand still about its own axis while the unit turns about another, which shows its cross-
    coupling; an accelerometer feels every turn. Where accelerometers move nearly all of the time and no gyro turns, as
    on a sled or a shaker, gyros are judged on all rows. What is neither fitted nor held out may be any motion: the rest
    is that of the rows in use.

    Raises
    ------
    InputError
        If the target is at rest in less than `LEAST_REST` of the rows that may be fitted, or of those held out.
    """
    table = any(has_table(r) or r.mounting.table_axis for r in recordings)
    if table or manifest.procedure != "static" or all(map(is_in_points, recordings)):
        return uses, ()
    used = [u.fit | u.held_out for u in uses]
    moving = [_moving(r, target, rows) & rows for r, rows in zip(recordings, used, strict=True)]
    if not any(m.any() for m in moving):
        return uses, ()
    kept = _without(uses, moving)
    if _rests_too_little(uses, kept):
        if target.startswith("gyro") and not any(
            _turns(r, rows).any() for r, rows in zip(recordings, used, strict=True)
        ):
            return uses, ()
        share = sum(int(m.sum()) for m in moving) / max(sum(int(rows.sum()) for rows in used), 1)
        raise InputError(_restless(manifest, recordings, used, target, share))
    found = [
        RejectedRows(target, run, a, b, REASON, "motion") for run, mask in enumerate(moving) for a, b in stretches(mask)
    ]
    return kept, tuple(found)


def _without(uses: Sequence[RowUse], rows: Sequence[NDArray[np.bool_]]) -> tuple[RowUse, ...]:
    return tuple(replace(u, fit=u.fit & ~r, held_out=u.held_out & ~r) for u, r in zip(uses, rows, strict=True))


def _rests_too_little(uses: Sequence[RowUse], kept: Sequence[RowUse]) -> bool:
    """Whether too small a share is left of the rows that may be fitted, or of those held out."""
    rested = sum(int(u.fit.sum()) for u in kept), sum(int(u.held_out.sum()) for u in kept)
    wanted = sum(int(u.fit.sum()) for u in uses), sum(int(u.held_out.sum()) for u in uses)
    return any(rows < LEAST_REST * of for rows, of in zip(rested, wanted, strict=True))


def _turns(recording: Recording, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows in which a gyro of the unit turns, shape (rows,): on a sled its accelerometers move alone."""
    gyros = [name for name in recording.channels if name.startswith("gyro")]
    return np.any([_departs(recording, n, used) | _swings(recording, n, used) for n in gyros], axis=0) & used


def motion_cautions(recordings: Sequence[Recording], rejected: Sequence[RejectedRows]) -> dict[str, tuple[str, ...]]:
    """For each target that moved, how long, and what to declare instead."""
    said: dict[str, tuple[str, ...]] = {}
    moved = [one for one in rejected if one.reason == REASON]
    for target in dict.fromkeys(one.target for one in moved):
        seconds = sum(one.stop - one.start for one in moved if one.target == target) * recordings[0].dt
        said[target] = (
            f"Declared at rest, but the unit moves for {seconds:.3g} s: these rows are left out. State the motion (a "
            'table\'s channels, or model.procedure = "multi-position"), or name the rests in fit.rows.',
        )
    return said


def _moving(recording: Recording, target: str, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows in which ``target`` moves, those within `BESIDE` seconds of them included, shape (rows,)."""
    if not used.any():
        return used
    names = [target]
    if target.startswith("accel"):
        names += [n for n in recording.channels if n.startswith(("gyro", "accel")) and n != target]
    swings = [_swings(recording, n, used) for n in recording.channels if n.startswith(("gyro", "accel"))]
    return np.any([_departs(recording, name, used) for name in names] + swings, axis=0)


def _swings(recording: Recording, name: str, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows in which a channel goes to and fro, shape (rows,): then the unit moves, and no channel of it is at rest."""
    values, none = recording.channels[name].values, np.zeros(len(recording), bool)
    rows = rows_of_a_second(recording.dt)
    means = values[: len(values) // rows * rows].reshape(-1, rows).mean(axis=1)
    width = int(round(WINDOW / SECOND))
    if len(means) < 4 * LASTS / SECOND:
        return none
    around = np.lib.stride_tricks.sliding_window_view(np.pad(means, width // 2, mode="reflect"), width)
    scatter = around.std(axis=1)
    own = used[: len(means) * rows].reshape(-1, rows).any(axis=1)
    quiet = float(np.quantile(scatter[own], QUIET)) if own.any() else 0.0
    limit = max(SWAYS if name.startswith("accel") else SWINGS, LOUDER * quiet)
    loud = scatter > limit
    for start, stop in stretches(loud):
        if stop - start >= LASTS / SECOND:
            beside = int(np.ceil(BESIDE / SECOND))
            none[max(start - beside, 0) * rows : (stop + beside) * rows] = True
    return none


def _departs(recording: Recording, name: str, used: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return departs(recording.channels[name].values, recording.dt, _limit(name), used)


def _limit(name: str) -> float:
    return TIPPED if name.startswith("accel") else TURNING


def _restless(
    manifest: Manifest, recordings: Sequence[Recording], used: Sequence[NDArray[np.bool_]], target: str, share: float
) -> str:
    values = np.concatenate([r.channel(target).values[rows] for r, rows in zip(recordings, used, strict=True)])
    most = float(np.abs(values - np.median(values)).max())
    size = f"{most:.3g} m/s^2" if target.startswith("accel") else f"{most / DEG:.3g} deg/s"
    return (
        f"{manifest.path}: {target} is declared at rest and moves in {100 * share:.0f} % of its rows, by up to {size}; "
        "wanted a unit at rest (fit.rows can name the rests), the channels of a table, or "
        'model.procedure = "multi-position"'
    )
