"""Manifest -> recordings in SI units.

value = factor * x + offset,  an increment divided by the sampling period
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import GAP, Channel, Covers, Floats, Recording, Segment, Site
from insenv.core.series.positions import (
    MOST_ROWS,
    angles_are_points,
    attitudes_were_set,
    of_untimed,
    rates_were_set,
    temperatures_were_set,
    were_set,
)
from insenv.core.series.rounding import counter_step, rounding
from insenv.core.series.stretches import stretches
from insenv.core.units import DIMENSIONS, scale_to_si
from insenv.data.cells.rows import evenly
from insenv.data.cells.thermometer import with_sound_temperature
from insenv.data.leaps import without_leaps
from insenv.data.manifest import ChannelSpec, Manifest, RunSpec
from insenv.data.manifest.spec import ACCELEROMETERS, CHANNELS, EVENTS, GYROS, INCREMENTS, Quantity
from insenv.data.readers import Column, Table, read_table
from insenv.data.readers.table import rows_of
from insenv.data.reference import ACCELEROMETER_TRIAD, ATTITUDE, TABLE, with_positions
from insenv.data.renewals import with_renewals
from insenv.data.resample import resampled, spread
from insenv.data.sampling import (
    SMOOTHER,
    Sampling,
    UnevenError,
    after_rollovers,
    at_mean_rate,
    at_one_stamp,
    by_the_clock,
    check_forwards,
    check_one_unit,
    in_packets,
    nearly_forwards,
    own_steps,
    round_rate,
    sampling,
)
from insenv.data.words import Mended, with_words

#: Rows of an unsure tick beside each other at most, for which their neighbours' line stands.
FEW_DOUBTFUL = 2
#: SI unit of the channels of each dimension.
SI_UNITS = {"rate": "rad/s", "acceleration": "m/s^2", "angle": "rad", "temperature": "K", "number": "1"}
#: No instrument reads, and no clock shows, as much as this in SI units: bytes misread as numbers do.
LARGEST = 1e12
#: No clock shows as many seconds: the year 5138.
LAST_SECOND = 1e11
#: Name of the column beside that of the time, where a stamp stands in two.
_NANOSECONDS = "nanoseconds"
#: More than this share of steps off by more than half a period is no even sampling.
UNEVEN_SHARE = 0.05
#: Most rows at an end that may be strays, and least rows that there must be for each of them.
MOST_STRAYS, FEWEST_BESIDE = 5, 10
#: Strays are further off than so many steps.
APART = 100.0
#: A share of equal rows beyond which they are how the recording is, and one below which they are no matter.
MOST_COPIES, FEW_COPIES = 0.2, 0.01
#: Share by which points may be further apart than is usual and be as good as evenly apart.
POINTS_APART = 0.01


def read_recordings(manifest: Manifest) -> tuple[Recording, ...]:
    """One recording per run, with every channel that the manifest names.

    Gyros and table rate in rad/s, accelerometers in m/s^2, table angle in rad (cumulative), temperature in K, power
    as the number of the power-up.

    Raises
    ------
    InputError
        If a file cannot be read, a column or unit is missing or wrong, a sample is not finite, the time does not run
        forwards, its steps follow no clock and are nothing alike or are counted by the manifest through several runs,
        or the number of the power-up is none.
    """
    read: list[Recording] = []
    uneven: list[UnevenError] = []
    tables = [
        _with_other_files(manifest, run, read_table(run, columns(manifest), manifest.columns)) for run in manifest.runs
    ]
    runs = list(zip(manifest.runs, with_words(tables), strict=True))
    for run, table in runs:
        try:
            read.append(_read_run(manifest, run, table))
        except UnevenError as error:
            uneven.append(error)
    if uneven:
        # One rate for all of them, even ones too.
        rate = min([e.rate for e in uneven] + [0.5 / r.dt for r in read])
        counted = bool(manifest.fit_rows or manifest.held_out.rows) and len(runs) > 1
        if counted or not (_at_any_time(manifest) or all(e.alike for e in uneven)):
            raise InputError(uneven[0].proposing(rate))
        anew = replace(manifest, resample=round_rate(rate))
        return tuple(_read_run(anew, run, table) for run, table in runs)
    return tuple(read)


def _at_any_time(manifest: Manifest) -> bool:
    """Whether it is all one when a row was read: of a unit at rest, or of accelerometers held still in attitudes."""
    gyros = any(target.startswith("gyro") for target in manifest.model.targets)
    attitudes = manifest.procedure == "multi-position" and not gyros and not _has_table(manifest)
    return _nothing_turns(manifest) or attitudes


def _nothing_turns(manifest: Manifest) -> bool:
    """Whether the unit is declared at rest: then a row may have been taken a little earlier or later."""
    table = _has_table(manifest) or any(r.mounting.table_axis for r in manifest.runs)
    return manifest.procedure == "static" and not table


def _has_table(manifest: Manifest) -> bool:
    return any(name in manifest.channels for name in TABLE)


def check_sampling(path: Path, t: Floats, place: Callable[[int], str]) -> None:
    """Refuse time that stands still, runs backwards or is not evenly sampled; gaps and jitter are allowed.

    Parameters
    ----------
    path : Path
        File to name.
    t : ndarray, shape (n,)
        Time of the rows [s].
    place : callable
        0-based row -> its place in the file.
    """
    if len(t) < 2:
        raise InputError(f"{path}: has {len(t)} row of data; wanted at least 2")
    steps = np.diff(t)
    if not (steps > 0).all():
        row = int(np.argmin(steps > 0)) + 1
        verb = "stands still" if t[row] == t[row - 1] else "runs backwards"
        found = f"{t[row]:.15g} s after {t[row - 1]:.15g} s"
        raise InputError(f"{path}: {place(row)}: time {verb} ({found}); wanted time that increases")
    period = float(np.median(steps))
    share = float(np.mean(np.abs(steps - period) > 0.5 * period * (1 + 1e-6)))  # stamps of 2, 3, 2, 3 ms pass
    if share > UNEVEN_SHARE:
        found = f"{100 * share:.0f} % of the steps are off the median of {period:.4g} s by more than half of it"
        raise InputError(f"{path}: not evenly sampled ({found}); wanted at most {100 * UNEVEN_SHARE:.0f} %")


def _read_run(manifest: Manifest, run: RunSpec, words: Mended) -> Recording:
    table = words.table
    t = time(manifest, run, table)
    t, anew = after_rollovers(t, _count(manifest, run, table), table.place)
    check_one_unit(run.file, t, table.place)
    table = _unwound(manifest, run, table)
    table, t, far = _without_strays(manifest, run, table, t)
    t, back = nearly_forwards(t, table.place)
    table, t, again = _without_copies(manifest, run, table, t)
    manifest, t, apart = _of_points(manifest, run, table, t)
    again = (*again, *apart)
    notes, stamps = (*table.notes, *table.behind, *words.notes, *anew, *far, *back, *again), t
    if table.notes and (manifest.fit_rows or manifest.held_out.rows):
        raise InputError(f"{run.file}: {table.notes[0]}; wanted all of them where {manifest.path} counts rows")
    if manifest.resample is not None:
        check_forwards(run.file, t, table.place)
        once = _read_once(manifest, run, table, t) if (np.diff(t) == 0).any() else None
        if once is not None:
            table, t, shared = once[0], once[1].t, (*once[2], *once[1].notes)
        else:
            t, shared = by_the_clock(t, table.values.get("table_angle")) or spread(t)
        notes = (*notes, *shared)
        own = np.append(np.median(np.diff(t)), np.diff(t))
        uneven = with_renewals(without_leaps(replace(recording(manifest, run, table, t, own), notes=notes)))
        return resampled(uneven, manifest.resample, f"{manifest.path}: fit.resample")
    table, taken, again = _taken(manifest, run, table, t)
    notes = (*notes, *again)
    if taken.angle is not None:
        table = replace(table, values={**table.values, "table_angle": taken.angle})
    read = without_leaps(replace(_recorded(manifest, run, table, taken), notes=notes))
    read = with_renewals(read, stamps - stamps[0] + read.t[0] if len(stamps) == len(read.t) else None)
    read = with_sound_temperature(read)
    instruments = [name for name in read.channels if name in (*GYROS, *ACCELEROMETERS)]
    # At rest a row may be of one tick or the next; what they read is as good as any.
    if not taken.doubtful.any() or _nothing_turns(manifest):
        return replace(read, notes=(*read.notes, *taken.notes))
    found = f"of {int(taken.doubtful.sum())} rows nobody can tell which tick of the clock is theirs"
    notes = (*read.notes, *taken.notes, f"{found}, first in row {int(np.argmax(taken.doubtful))}: left out")
    # At a wrong tick a reading of the table is a leap of the motion, and what multiplies its change hangs on leaps.
    table_channels = {
        name: replace(channel, values=_bridged(read.t, channel.values, taken.doubtful, name == "table_angle"))
        for name, channel in read.channels.items()
        if name not in instruments
    }
    names = (*instruments, *(name for name in TABLE if name in read.channels))
    left_out = {name: taken.doubtful | read.left_out.get(name, False) for name in names}
    return replace(read, channels={**read.channels, **table_channels}, notes=notes, left_out=left_out)


def _recorded(manifest: Manifest, run: RunSpec, table: Table, taken: Sampling) -> Recording:
    """The rows in SI units, increments by the steps of their rows where they are smoother so than by a period each.

    Stamps that wander a little are the sampler's, and then the increments wander with them, or the recorder's.
    """
    read = recording(manifest, run, table, taken.t, taken.covered)
    moved = [channel.values for channel in read.channels.values() if channel.by_period and np.ptp(channel.values)]
    if not moved or not isinstance(taken.covered, float) or evenly(taken.t, taken.covered):
        return read
    own = own_steps(taken.t, taken.covered)

    def rough(values: Floats) -> float:
        return float(np.median(np.abs(np.diff(values))))

    smoother = all(rough(values * (taken.covered / own)) < SMOOTHER * rough(values) for values in moved)
    return recording(manifest, run, table, taken.t, own) if smoother else read


def _bridged(t: Floats, values: Floats, doubtful: NDArray[np.bool_], moves: bool) -> Floats:
    """Values with those of rows here and there made of their neighbours': of what ``moves`` the count between them."""
    doubtful = doubtful.copy()
    for a, b in stretches(doubtful):
        doubtful[a:b] &= b - a <= FEW_DOUBTFUL  # of many there is no line between their neighbours
    row, sure = np.arange(len(values)), np.flatnonzero(~doubtful)
    if not moves:
        last = np.maximum(np.searchsorted(sure, row, side="right") - 1, 0)
        return np.where(doubtful, values[sure[last]], values)
    between = np.interp(t, t[sure], values[sure])
    if step := counter_step(values):
        between = values[0] + np.rint((between - values[0]) / step) * step
    return np.where(doubtful, between, values)


def _taken(manifest: Manifest, run: RunSpec, table: Table, t: Floats) -> tuple[Table, Sampling, tuple[str, ...]]:
    """The rows and when they were taken."""
    if _nothing_turns(manifest) and in_packets(t):
        if (even := at_mean_rate(run.file, t, table.place)) is not None:
            return table, even, ()
        if not at_one_stamp(t):
            raise UnevenError(run.file, t)
        found = "most rows have the stamp of others, as if they had come in packets, and these follow no even rate"
        rate = (len(t) - 1) / float(t[-1] - t[0])
        raise InputError(f'{run.file}: {found}; wanted the rate instead, as time = {{ rate = "{rate:.4g} Hz" }}')
    try:
        return table, sampling(run.file, t, table.place, table.values.get("table_angle")), ()
    except UnevenError:
        if not _at_any_time(manifest):
            once = _read_once(manifest, run, table, t)
            if once is None:
                raise
            return once
        rested = at_mean_rate(run.file, t, table.place)
        if rested is None:
            raise
        return table, rested, ()


def _read_once(
    manifest: Manifest, run: RunSpec, table: Table, t: Floats
) -> tuple[Table, Sampling, tuple[str, ...]] | None:
    """The rows without readings that were read twice, and when they were taken; None where they keep no clock.

    A chip that is asked a little more often than it renews its output gives the same reading again, and stamps of who
    asked wander about it. What is left follows the clock of the chip.
    """
    again = _again(table)
    if not FEW_COPIES <= again.mean() <= MOST_COPIES or manifest.fit_rows or manifest.held_out.rows:
        return None
    kept = np.flatnonzero(~again)
    rows = rows_of(table, kept)
    try:
        taken = sampling(run.file, t[kept], rows.place, rows.values.get("table_angle"))
    except UnevenError:
        return None
    noun = "row repeats" if again.sum() == 1 else "rows repeat"
    text = f"{int(again.sum())} {noun} the readings of the row before, and the others keep a clock: left out"
    return rows, taken, (text,)


def _again(table: Table) -> NDArray[np.bool_]:
    """Rows that repeat all readings of the row before, shape (n,)."""
    again = np.append(False, np.ones(len(table) - 1, bool))
    for name, values in table.values.items():
        if name not in ("time", _NANOSECONDS):
            again[1:] &= np.diff(values) == 0
    return again


def _without_strays(manifest: Manifest, run: RunSpec, table: Table, t: Floats) -> tuple[Table, Floats, tuple[str, ...]]:
    """The table without a few rows at either end that lie further off than all the others last.

    Raises
    ------
    InputError
        If there are such rows and the manifest counts rows.
    """
    notes = []
    for end in ("first", "last"):
        steps = np.abs(np.diff(t))
        few = min(MOST_STRAYS, len(steps) // FEWEST_BESIDE)
        if not few:
            break
        at = int(np.argmax(steps[:few])) if end == "first" else len(steps) - few + int(np.argmax(steps[-few:]))
        rest = slice(at + 1, None) if end == "first" else slice(0, at + 1)
        own = slice(0, at + 1) if end == "first" else slice(at + 1, None)
        if not steps[at] > max(np.ptp(t[rest]), APART * float(np.median(steps))) > 0:
            continue
        count = len(t[own])
        rows = f"the {end} row" if count == 1 else f"the {end} {count} rows"
        verb = "lies" if count == 1 else "lie"
        found = f"{rows} {verb} {steps[at]:.6g} s from the others, which last {np.ptp(t[rest]):.4g} s"
        if manifest.fit_rows or manifest.held_out.rows:
            hint = f"wanted read.skip = {count}" if end == "first" else "wanted a file without"
            raise InputError(f"{run.file}: {table.place(int(np.arange(len(t))[own][0]))}: {found}; {hint}")
        notes.append(f"{found}: left out")
        table, t = rows_of(table, np.arange(len(t))[rest]), t[rest]
    return table, t, tuple(notes)


def _without_copies(manifest: Manifest, run: RunSpec, table: Table, t: Floats) -> tuple[Table, Floats, tuple[str, ...]]:
    """The table without rows that repeat the row before in everything, time included.

    Raises
    ------
    InputError
        If there are such rows and the manifest counts rows.
    """
    again = np.append(False, np.diff(t) == 0)
    if again.any():
        again &= _again(table)
    if not again.any() or again.mean() > MOST_COPIES:
        return table, t, ()
    row = int(np.argmax(again))
    if manifest.fit_rows or manifest.held_out.rows:
        found = f"{table.place(row)}: repeats the row before, one of {int(again.sum())} such rows"
        raise InputError(f"{run.file}: {found}; wanted none of them where {manifest.path} counts rows")
    kept = np.flatnonzero(~again)
    table = rows_of(table, kept)
    noun = "row repeats" if again.sum() == 1 else "rows repeat"
    return table, t[kept], (f"{int(again.sum())} {noun} the row before in everything, time included: left out",)


def columns(manifest: Manifest, file: Path | None = None) -> list[Column]:
    """Columns that the manifest's channels want of the run's file, or of the ``file`` that some of them have.

    A time that is told by its rate has none, one in two columns has both.
    """
    found = [
        Column(name, spec.column, label=name == "segment")
        for name, spec in manifest.channels.items()
        if spec.file == file and not (name in ("time", "segment") and (spec.rate is not None or spec.column == "row"))
        if not spec.stated
    ]
    spec = manifest.channels.get("time")
    beside = [] if spec is None or spec.nanoseconds is None or file is not None else [spec.nanoseconds]
    return found + [Column(_NANOSECONDS, key) for key in beside]


def _with_other_files(manifest: Manifest, run: RunSpec, table: Table) -> Table:
    """The run's table with the columns of channels that have a file of their own, and those that the run states."""
    for spec in {s.file: s for s in manifest.channels.values() if s.file is not None}.values():
        assert spec.file is not None
        other = read_table(replace(run, file=spec.file, format=spec.format), columns(manifest, spec.file))
        if len(table) not in (0, len(other)):
            found = f"has {len(other)} rows against {len(table)} in {run.file.name}"
            raise InputError(f"{spec.file}: {found}; wanted as many, at the same times")
        table = replace(table, values={**table.values, **other.values}, units={**table.units, **other.units})
    return with_stated(run, table)


def with_stated(run: RunSpec, table: Table) -> Table:
    """The table of a run, or a part of it, with the channels that the run states."""
    if not run.stated:
        return table
    stated = {name: np.full(len(table), value) for name, value in run.stated}
    return replace(table, values={**table.values, **stated})


def recording(
    manifest: Manifest, run: RunSpec, table: Table, t: Floats, dt: float | Floats, first: int = 0
) -> Recording:
    """Rows of a file as a recording in SI units: at times ``t``, their increments over the time ``dt`` that they cover.

    ``first`` is the number of row 0 in the file, counted from 0.

    Raises
    ------
    InputError
        As `read_recordings`; the time is not looked at.
    """
    names = [name for name in manifest.channels if name not in ("time", "segment")]
    channels = {name: _channel(manifest, run, table, name, dt) for name in names}
    segments: tuple[Segment, ...] = ()
    if manifest.segment_is_row:
        segments = tuple(Segment(str(first + k + 1), k, k + 1) for k in range(len(table)))
    elif "segment" in manifest.channels:
        segments = _segments(table.labels["segment"])
    found = Recording(t, channels, segments, _site(run.site, table.site), run.mounting, run.label)
    return _with_whole_turns(found, manifest, run, table)


def time(manifest: Manifest, run: RunSpec, table: Table, first: int = 0) -> Floats:
    """Time of the rows [s]: a column, the row's number in the file (``first``: of row 0), or as the format fixes it.

    Raises
    ------
    InputError
        If the manifest names no time and the file has none of its own, or its unit is wrong.
    """
    spec = manifest.channels.get("time")
    if spec is None:
        if table.t is None:
            raise InputError(f"{manifest.path}: channels.time is missing; {run.file.name} has no time of its own")
        return table.t
    if spec.rate is not None or spec.column == "row":
        rows = np.arange(first, first + len(table)) if table.index is None else table.index
        return rows / (spec.rate or 1.0)
    if "time" in table.stamped and spec.unit not in (None, "s"):
        wanted = "wanted 's', for dates are read in seconds"
        raise InputError(f"{manifest.path}: channels.time.unit = '{spec.unit}' of a column of dates; {wanted}")
    t = _scaled(manifest, run, table, "time", "time")
    return t if spec.nanoseconds is None else t + 1e-9 * table.values[_NANOSECONDS]


def _of_points(manifest: Manifest, run: RunSpec, table: Table, t: Floats) -> tuple[Manifest, Floats, tuple[str, ...]]:
    """Of rows that are points the manifest with it said what was set, and times as far apart as is usual."""
    points = _points(manifest, run, table, t)
    if points is None:
        return manifest, t, ()
    if points in ("temperature", ATTITUDE):
        names = ACCELEROMETER_TRIAD if points == ATTITUDE else (points,)
        was_set = {name: replace(manifest.channels[name], source="set") for name in names}
        manifest = replace(manifest, channels={**manifest.channels, **was_set})
    return manifest, *_evenly_apart(t, points)


def _points(manifest: Manifest, run: RunSpec, table: Table, t: Floats) -> str | None:
    """What each row is a point of: the table's rate or angle, of a unit at rest its attitude or the temperature."""
    if "table_angle" in table.values:
        return "table_angle" if _are_set_angles(manifest, run, table, t) else None
    if "table_rate" in table.values:
        told = manifest.channels["table_rate"].source != "encoder"
        return "table_rate" if told and rates_were_set(t, table.values["table_rate"]) else None
    if not _nothing_turns(manifest):
        return None
    if _are_attitudes(manifest, run, table, t):
        return ATTITUDE
    if "temperature" not in table.values:
        return None
    kelvins = _scaled(manifest, run, table, "temperature", "temperature")
    was_set = manifest.channels["temperature"].source == "set"
    return "temperature" if was_set or temperatures_were_set(_apart(manifest, t), kelvins) else None


def _are_set_angles(manifest: Manifest, run: RunSpec, table: Table, t: Floats) -> bool:
    """Whether the table was set from row to row, and no rate is there: the manifest says so, or the angles do."""
    source = manifest.channels["table_angle"].source
    if "table_rate" in table.values or source not in (None, "set"):
        return False
    angle, apart = _scaled(manifest, run, table, "table_angle", "angle"), _apart(manifest, t)
    return angles_are_points(apart, angle) and (source == "set" or were_set(apart, angle))


def _are_attitudes(manifest: Manifest, run: RunSpec, table: Table, t: Floats) -> bool:
    """Whether the accelerometers of a unit at rest read gravity from another side in each row."""
    if not all(name in table.values for name in ACCELEROMETER_TRIAD):
        return False
    if any((manifest.channels[n].quantity or table.quantity) == "increment" for n in ACCELEROMETER_TRIAD):
        return False
    forces = np.array([_scaled(manifest, run, table, name, "acceleration") for name in ACCELEROMETER_TRIAD])
    return attitudes_were_set(_apart(manifest, t), forces)


def _apart(manifest: Manifest, t: Floats) -> Floats:
    """Times to tell points by: those of rows that have none but their numbers are as far apart as is wanted."""
    return t if manifest.timed or len(t) > MOST_ROWS else of_untimed(len(t))


def _evenly_apart(t: Floats, points: str) -> tuple[Floats, tuple[str, ...]]:
    """Times of points, as far apart as is usual, and a word where they were not so.

    No clock has to be found in them: between two of them somebody set the table, or waited.
    """
    steps = np.diff(t)
    usual = float(np.median(steps))
    if np.abs(steps - usual).max() <= POINTS_APART * usual:
        return t, ()
    least, most = float(steps.min()), float(steps.max())
    what = points.removeprefix("table_")
    text = f"rows are points at one {what} each, {least:.3g} to {most:.3g} s apart: taken as {usual:.3g} s apart"
    return t[0] + usual * np.arange(len(t)), (text,)


def _count(manifest: Manifest, run: RunSpec, table: Table) -> float:
    """What a count of the time column is [s]."""
    spec = manifest.channels.get("time")
    of_column = spec is not None and spec.rate is None and "time" in table.values and "time" not in table.stamped
    return _unit(manifest, run, table, spec, "time", "time")[0] if spec is not None and of_column else 1.0


def _channel(manifest: Manifest, run: RunSpec, table: Table, name: str, dt: float | Floats) -> Channel:
    """One channel in SI units."""
    spec, dimension = manifest.channels[name], CHANNELS[name]
    if name == "turning":
        return Channel(table.values[name], SI_UNITS[dimension], spec.covers or "interval")
    if dimension == "number":
        check_power(run.file, table.values[name], table.place)
        return Channel(table.values[name], SI_UNITS[dimension])
    quantity: Quantity = spec.quantity or (table.quantity if dimension in INCREMENTS else "rate")
    covers: Covers = spec.covers or ("interval" if quantity == "increment" else "instant")
    if quantity != "increment":
        values = _scaled(manifest, run, table, name, dimension)
        return Channel(values, SI_UNITS[dimension], covers, spec.delay, spec.source)
    counts = _scaled(manifest, run, table, name, INCREMENTS[dimension])
    step = rounding(counts) / float(np.median(dt))
    even = np.ndim(dt) == 0
    return Channel(counts / dt, SI_UNITS[dimension], covers, spec.delay, spec.source, step=step, by_period=even)


def check_power(path: Path, numbers: Floats, place: Callable[[int], str], before: float = 1.0) -> None:
    """Refuse what is no number of a power-up: these are whole and never fall; ``before`` is that of the row before."""
    sound = (numbers >= np.append(before, numbers[:-1])) & (numbers == np.rint(numbers))
    if not sound.all():
        row = int(np.argmin(sound))
        last = numbers[row - 1] if row else before
        wanted = f"wanted the number of the power-up, a whole one that never falls, here {last:g} or more"
        raise InputError(f"{path}: {place(row)}: channels.power is {numbers[row]:g}; {wanted}")


def _scaled(manifest: Manifest, run: RunSpec, table: Table, name: str, dimension: str) -> Floats:
    """Samples of ``name`` in the SI unit of ``dimension``."""
    spec = manifest.channels[name]
    factor, offset = _unit(manifest, run, table, spec, name, dimension)
    with np.errstate(over="ignore"):
        values = factor * (table.values[name] - spec.offset) + offset
    low = 0.0 if name == "temperature" else -LARGEST
    high = LAST_SECOND if name == "time" else LARGEST
    sound = (values >= low) & (values <= high)
    if name in EVENTS:
        sound |= np.isnan(values)
    if not sound.all():
        row = int(np.argmin(sound))
        found = f"{values[row]:.6g} in SI units"
        wanted = f"wanted a number from {low:g} to {high:g}"
        if name == "time" and (finer := _finer(float(np.abs(values).max() / factor))):
            wanted += f', as with channels.time.unit = "{finer}"'
        raise InputError(f"{run.file}: {table.place(row)}: column {spec.column!r} is {found}; {wanted}")
    return values


def _finer(stamp: float) -> str:
    """The unit in which a stamp is one of our time, if it is one of those that clocks count."""
    counts = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    return next((unit for unit, size in counts.items() if stamp * size < LAST_SECOND), "")


def _unit(
    manifest: Manifest, run: RunSpec, table: Table, spec: ChannelSpec, name: str, dimension: str
) -> tuple[float, float]:
    """Factor and offset to SI: the manifest's unit, else the one in the file's header."""
    if spec.unit is not None:
        return scale_to_si(spec.unit, dimension, f"{manifest.path}: channels.{name}.unit")
    if name in table.units:
        return scale_to_si(table.units[name], dimension, f"{run.file}: unit of column {spec.column!r}")
    example = DIMENSIONS[dimension].example
    missing = f"channels.{name}.unit is missing and {run.file.name} states none"
    raise InputError(f"{manifest.path}: {missing}; wanted one such as {example!r}")


def _site(said: Site, found: Site | None) -> Site:
    """What the manifest says of the site; else what the file does."""
    if found is None:
        return said
    latitude = found.latitude if said.latitude is None else said.latitude
    return Site(latitude, said.altitude or found.altitude, found.gravity if said.gravity is None else said.gravity)


def _segments(labels: Sequence[str]) -> tuple[Segment, ...]:
    """Stretches of equal labels; rows without a label belong to none."""
    breaks = [i for i, (a, b) in enumerate(pairwise(labels), start=1) if a != b]
    edges = [0, *breaks, len(labels)]
    return tuple(Segment(labels[a], a, b) for a, b in pairwise(edges) if labels[a])


def _unwound(manifest: Manifest, run: RunSpec, table: Table) -> Table:
    """The rows with the table's angle made cumulative where it is declared wrapped, in the unit of its column.

    What time the rows were taken is asked of it: a turn between two rows is no step of its encoder, and no roughness.
    """
    spec = manifest.channels.get("table_angle")
    if spec is None or not spec.wrapped or "table_angle" not in table.values:
        return table
    factor, _ = _unit(manifest, run, table, spec, "table_angle", "angle")
    angle = np.unwrap(table.values["table_angle"], period=2 * np.pi / abs(factor))
    return replace(table, values={**table.values, "table_angle": angle})


def _with_whole_turns(recording: Recording, manifest: Manifest, run: RunSpec, table: Table) -> Recording:
    """The table's angle made cumulative where it is declared wrapped; refused where it jumps undeclared."""
    recording = with_positions(recording, _apart(manifest, recording.t))
    if "table_angle" not in recording.channels:
        return recording
    channel, turn = recording.channels["table_angle"], 2 * np.pi
    if channel.source == "set":
        return recording
    if manifest.channels["table_angle"].wrapped:
        unwrapped = replace(channel, values=np.unwrap(channel.values, period=turn))
        return replace(recording, channels={**recording.channels, "table_angle": unwrapped})
    steps = np.abs(np.diff(channel.values))
    jumps = (np.abs(steps - turn) < 0.1 * turn) & (np.diff(recording.t) <= GAP * recording.dt)
    if jumps.any() and np.median(steps) < 0.25 * turn:
        row = int(np.argmax(jumps)) + 1
        found = f"{table.place(row)}: channels.table_angle jumps by a full turn"
        wanted = f'a cumulative angle, or wrapped = true (or source = "set" of one set row by row) in {manifest.path}'
        raise InputError(f"{run.file}: {found}; wanted {wanted}")
    return recording
