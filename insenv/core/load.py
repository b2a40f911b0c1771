"""Manifest -> recordings in SI units.

value = factor * x + offset,  an increment divided by the sampling period
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.core.manifest import ChannelSpec, Manifest, RunSpec
from insenv.core.manifest.spec import CHANNELS, INCREMENTS, Quantity
from insenv.core.readers import Column, Table, read_table
from insenv.core.recording import GAP, Channel, Covers, Floats, Recording, Segment, Site
from insenv.core.units import DIMENSIONS, scale_to_si

#: SI unit of the channels of each dimension.
SI_UNITS = {"rate": "rad/s", "acceleration": "m/s^2", "angle": "rad", "temperature": "K"}
#: No instrument reads, and no clock shows, as much as this in SI units: bytes misread as numbers do.
LARGEST = 1e12
#: More than this share of steps off by more than half a period is no even sampling.
UNEVEN_SHARE = 0.05


def read_recordings(manifest: Manifest) -> tuple[Recording, ...]:
    """One recording per run, with every channel that the manifest names.

    Gyros and table rate in rad/s, accelerometers in m/s^2, table angle in rad (cumulative), temperature in K.

    Raises
    ------
    InputError
        If a file cannot be read, a column or unit is missing or wrong, a sample is not finite, or the time
        does not run forwards in even steps (gaps apart).
    """
    return tuple(_read_run(manifest, run) for run in manifest.runs)


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


def _read_run(manifest: Manifest, run: RunSpec) -> Recording:
    specs = {n: s for n, s in manifest.channels.items() if n != "time" or (s.rate is None and s.column != "row")}
    columns = [Column(name, spec.column, label=name == "segment") for name, spec in specs.items()]
    table = read_table(run, columns, manifest.columns)
    t = _time(manifest, run, table)
    check_sampling(run.file, t, table.place)
    bare = Recording(t, {}, site=_site(run.site, table.site), mounting=run.mounting, label=run.label)
    channels = {
        name: _channel(manifest, run, table, name, bare.dt) for name in specs if name not in ("time", "segment")
    }
    segments = _segments(table.labels["segment"]) if "segment" in specs else ()
    recording = replace(bare, channels=channels, segments=segments)
    return _with_whole_turns(recording, manifest, run, table)


def _time(manifest: Manifest, run: RunSpec, table: Table) -> Floats:
    """Time of the rows [s]: a column, the row's index, or what the format fixes."""
    spec = manifest.channels.get("time")
    if spec is None:
        if table.t is None:
            raise InputError(f"{manifest.path}: channels.time is missing; {run.file.name} has no time of its own")
        return table.t
    if spec.rate is not None or spec.column == "row":
        return np.arange(len(table)) / (spec.rate or 1.0)
    return _scaled(manifest, run, table, "time", "time")


def _channel(manifest: Manifest, run: RunSpec, table: Table, name: str, dt: float) -> Channel:
    """One channel in SI units."""
    spec, dimension = manifest.channels[name], CHANNELS[name]
    quantity: Quantity = spec.quantity or (table.quantity if dimension in INCREMENTS else "rate")
    covers: Covers = spec.covers or ("interval" if quantity == "increment" else "instant")
    if quantity == "increment":
        values = _scaled(manifest, run, table, name, INCREMENTS[dimension]) / dt
    else:
        values = _scaled(manifest, run, table, name, dimension)
    return Channel(values, SI_UNITS[dimension], covers, spec.delay)


def _scaled(manifest: Manifest, run: RunSpec, table: Table, name: str, dimension: str) -> Floats:
    """Samples of ``name`` in the SI unit of ``dimension``."""
    spec = manifest.channels[name]
    factor, offset = _unit(manifest, run, table, spec, name, dimension)
    with np.errstate(over="ignore"):
        values = factor * table.values[name] + offset
    low = 0.0 if name == "temperature" else -LARGEST
    sound = (values >= low) & (values <= LARGEST)
    if not sound.all():
        row = int(np.argmin(sound))
        found = f"{values[row]:.6g} in SI units"
        wanted = f"wanted a number from {low:g} to {LARGEST:g}"
        raise InputError(f"{run.file}: {table.place(row)}: column {spec.column!r} is {found}; {wanted}")
    return values


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


def _with_whole_turns(recording: Recording, manifest: Manifest, run: RunSpec, table: Table) -> Recording:
    """The table's angle made cumulative where it is declared wrapped; refused where it jumps undeclared."""
    if "table_angle" not in recording.channels:
        return recording
    channel, turn = recording.channels["table_angle"], 2 * np.pi
    if manifest.channels["table_angle"].wrapped:
        unwrapped = replace(channel, values=np.unwrap(channel.values, period=turn))
        return replace(recording, channels={**recording.channels, "table_angle": unwrapped})
    steps = np.abs(np.diff(channel.values))
    jumps = (np.abs(steps - turn) < 0.1 * turn) & (np.diff(recording.t) <= GAP * recording.dt)
    if jumps.any() and np.median(steps) < 0.25 * turn:
        row = int(np.argmax(jumps)) + 1
        found = f"{table.place(row)}: channels.table_angle jumps by a full turn"
        raise InputError(f"{run.file}: {found}; wanted a cumulative angle, or wrapped = true in {manifest.path}")
    return recording
