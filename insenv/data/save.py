"""Recordings -> data files and a manifest that reads them back; SI units throughout.

What is written appears whole or not at all: under a temporary name first, the manifest last.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.files import WRITERS, Format, replacing, toml
from insenv.core.recording import Recording
from insenv.data.manifest import HeldOut, Model, RowRanges
from insenv.data.manifest.checks import NOISE_UNITS
from insenv.data.manifest.gimbals import gimbals_table
from insenv.data.manifest.spec import ACCELEROMETERS, BARE

Noise = Mapping[str, Mapping[str, float]]


def save(  # noqa: PLR0913 - what a manifest says, entry by entry
    manifest: Path,
    recordings: Sequence[Recording],
    model: Model,
    *,
    title: str = "",
    noise: Noise | None = None,
    held_out: HeldOut | None = None,
    fit_rows: RowRanges = (),
    data_format: Format = "npz",
    datasheet: Mapping[str, object] | None = None,
) -> None:
    """Write ``recordings`` beside ``manifest`` and the manifest itself; existing files are replaced.

    The data files are named after the manifest: ``run.toml`` has ``run_1.npz``, ``run_2.npz``, ...
    Gaps, segments, delays, site and mounting are kept: ``read_recordings`` gives back what was saved. ``datasheet``:
    the table of `insenv.scenario.measured`.

    Raises
    ------
    InputError
        If the recordings differ in their channels, pyarrow is missing for Parquet, or writing fails.
    """
    _check_alike(recordings)
    names = [f"{manifest.stem}_{i}.{data_format}" for i in range(1, len(recordings) + 1)]
    text = _manifest_text(
        recordings, names, model, title or manifest.stem, noise or {}, (held_out or HeldOut(), fit_rows)
    )
    try:
        manifest.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{manifest}: cannot be written ({error.strerror or error})") from None
    text += toml(nested("datasheet", datasheet or {}))
    with ExitStack() as stack:  # left in reverse order: the manifest appears when its data are there
        stack.enter_context(replacing(manifest)).write_text(text, encoding="utf-8")
        for name, recording in zip(names, recordings, strict=True):
            path = stack.enter_context(replacing(manifest.parent / name))
            WRITERS[data_format](path, _table(recording))


def nested(head: str, table: Mapping[str, object]) -> list[tuple[str, Mapping[str, object]]]:
    """A table and the tables and lists of tables in it, each under its own head."""
    found: list[tuple[str, Mapping[str, object]]] = []
    own: dict[str, object] = {}
    for name, value in table.items():
        if isinstance(value, Mapping):
            found += nested(f"{head}.{_key(name)}", value)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            found += [(f"[[{head}.{_key(name)}]]", one) for one in value]
        else:
            own[name] = value
    return [(f"[{head}]", own), *found]


def _key(name: str) -> str:
    return name if name.replace("_", "").isalnum() else f'"{name}"'


def _check_alike(recordings: Sequence[Recording]) -> None:
    """One manifest describes the channels of all its runs."""
    if not recordings:
        raise InputError("no recordings to save; wanted at least one")
    layouts = [_layout(recording) for recording in recordings]
    labelled = bool(recordings[0].segments)
    for recording, layout in zip(recordings, layouts, strict=True):
        if layout != layouts[0] or bool(recording.segments) != labelled:
            first = recordings[0].label
            raise InputError(f"{recording.label}: channels differ from those of {first}; wanted the same in all")


def _layout(recording: Recording) -> dict[str, tuple[str, str, float]]:
    return {name: (c.unit, c.covers, c.delay) for name, c in recording.channels.items()}


def _table(recording: Recording) -> dict[str, Any]:
    """Columns by name; times and samples as float64, labels of the segments as text."""
    columns: dict[str, Any] = {"time": recording.t}
    columns |= {name: channel.values for name, channel in recording.channels.items()}
    if not recording.segments:
        return columns
    labels = np.full(len(recording), "", dtype=object)
    for segment in recording.segments:
        labels[segment.start : segment.stop] = segment.label
    return columns | {"segment": labels.astype(str)}


def _manifest_text(
    recordings: Sequence[Recording],
    names: Sequence[str],
    model: Model,
    title: str,
    noise: Noise,
    used: tuple[HeldOut, RowRanges],
) -> str:
    """TOML of the whole manifest; ``used`` is what is held out, and the rows that may be fitted."""
    tables: list[tuple[str, Mapping[str, object]]] = [("", {"title": title})]
    for recording, name in zip(recordings, names, strict=True):
        tables.append(("[[runs]]", {"file": name, "label": recording.label}))
        tables.append(("[runs.site]", _site(recording)))
        tables += nested("runs.mounting", _mounting(recording))
    tables.append(("[channels.time]", {"unit": "s"}))
    tables += [
        (f"[channels.{n}]", _channel(n, *layout) | _origin(n, recordings[0]))
        for n, layout in _layout(recordings[0]).items()
    ]
    if recordings[0].segments:
        tables.append(("[channels.segment]", {"column": "segment"}))
    tables.append(("[model]", _model(model)))
    tables += [(f"[noise.{target}]", _noise(target, given)) for target, given in noise.items() if given]
    tables.append(("[held_out]", _held_out(used[0])))
    tables.append(("[fit]", {"rows": _pairs(used[1])} if used[1] else {}))
    return toml(tables)


def _site(recording: Recording) -> dict[str, object]:
    units = {"latitude": "rad", "altitude": "m", "gravity": "m/s^2"}
    given = {f.name: getattr(recording.site, f.name) for f in fields(recording.site)}
    return {name: _quantity(value, units[name]) for name, value in given.items() if value is not None}


def _mounting(recording: Recording) -> dict[str, object]:
    mounting = recording.mounting
    turned: dict[str, object] = {"base_turned": _quantity(mounting.base_turned, "rad")} if mounting.base_turned else {}
    if mounting.table_axis:
        return {"axes": mounting.axes, "table_axis": mounting.table_axis} | turned
    if mounting.gimbals is not None:
        return {"axes": mounting.axes, "gimbals": gimbals_table(mounting.gimbals)} | turned
    return {"tilt": _quantity(mounting.tilt, "rad"), "axes": mounting.axes} | turned


def _channel(name: str, unit: str, covers: str, delay: float) -> dict[str, object]:
    table: dict[str, object] = {"column": name} if name in BARE else {"unit": unit}
    if covers != "instant":
        table["covers"] = covers
    if delay:
        table["delay"] = _quantity(delay, "s")
    return table


def _origin(name: str, recording: Recording) -> dict[str, object]:
    """Where a channel comes from, as far as a manifest may say it: attitudes are found out from the forces again."""
    source = recording.channels[name].source
    return {"source": source} if source is not None and not name.startswith(("gyro", "accel")) else {}


def _model(model: Model) -> dict[str, object]:
    table: dict[str, object] = {
        "target": list(model.targets),
        "declared": list(model.declared),
        "reference_temperature": _quantity(model.reference_temperature, "K"),
    }
    optional = {"procedure": model.procedure, "bias": model.bias}
    return table | {name: value for name, value in optional.items() if value is not None}


def _noise(target: str, given: Mapping[str, float]) -> dict[str, object]:
    is_accelerometer = target in ACCELEROMETERS
    return {name: _quantity(value, NOISE_UNITS[name][is_accelerometer]) for name, value in given.items()}


def _held_out(held_out: HeldOut) -> dict[str, object]:
    given: dict[str, object] = {"runs": list(held_out.runs), "rows": _pairs(held_out.rows)}
    if held_out.start is not None:
        given["start"] = _quantity(held_out.start, "s")
    positions = held_out.positions
    given["positions"] = list(positions) if isinstance(positions, tuple) else positions
    if held_out.averaging is not None:
        given["averaging"] = _quantity(held_out.averaging, "s")
    return {name: value for name, value in given.items() if value}


def _pairs(rows: RowRanges) -> list[list[int]]:
    return [list(pair) for pair in rows]


def _quantity(value: float, unit: str) -> str:
    return f"{float(value)!r} {unit}"
