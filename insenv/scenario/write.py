"""What a scenario leaves behind: the recording, its manifest and, where asked for, the truth.

Every file is written under a temporary name and takes its own only when it is whole; the manifest comes
last. The undeclared effects are in none of them but the truth.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from insenv.core.errors import InputError
from insenv.core.files import WRITERS, replacing, toml
from insenv.core.recording import Floats
from insenv.core.units import scale_to_si
from insenv.data.manifest.spec import CHANNELS, INCREMENTS
from insenv.data.save import nested
from insenv.effects.angle import EarthRate
from insenv.effects.base import OUTPUT, Effect
from insenv.rig import Readings
from insenv.scenario.build import Scenario
from insenv.scenario.datasheet import datasheet
from insenv.scenario.measured import sheet_table
from insenv.scenario.schema import UNITS, OutputTable, TurntableTable, family, family_name
from insenv.scenario.values import given, not_negative
from insenv.sensors.chain import Sensor
from insenv.sensors.counter import count

Progress = Callable[[int, int], None]
#: Seeds of the noise of two files of one unit are so far apart.
FILES_APART = 1_000_003


#: What a column carries from chunk to chunk: the part of a pulse, or the last reading and how many rows ago it was new.
Carried = Any


@dataclass(frozen=True)
class WrittenColumn:
    """A column: ``value = (si * increment - offset) / factor``, with ``increment`` [s] None for a rate.

    It shows the ``reference`` of the plant's log, or the instrument of its own name. ``per_second`` of an angle whose
    change is shown as a rate; ``gain``, ``renewed`` (rows) and ``resolution`` (SI) are what a logger makes of it.
    """

    name: str
    unit: str
    factor: float
    offset: float = 0.0
    increment: float | None = None
    over_interval: bool = False
    pulses: bool = False
    reference: str = ""
    per_second: float = 0.0
    gain: float = 1.0
    renewed: int = 1
    resolution: float = 0.0

    @property
    def header(self) -> str:
        """Name with unit, as the file's first line has it."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def shown(self, si: Floats, carried: Carried) -> tuple[Floats, Carried]:
        """Values of the column, shape (n,), and what it carries on."""
        if self.per_second:
            before = 2 * si[0] - si[1] if isinstance(carried, float) else carried[0]
            si, carried = np.diff(si, prepend=before) * self.per_second, (si[-1],)
        if self.renewed > 1:
            si, carried = self._held(si, carried)
        si = self.gain * si
        if self.resolution:
            si = self.resolution * np.rint(si / self.resolution)
        values = (si * (self.increment or 1.0) - self.offset) / self.factor
        return count(values, carried) if self.pulses else (values, carried)

    def _held(self, si: Floats, carried: Carried) -> tuple[Floats, Carried]:
        """The output as it was renewed last; it begins at a random part of the way to the next renewal."""
        age, last = (int(carried * self.renewed), si[0]) if isinstance(carried, float) else carried
        ages = (age + np.arange(len(si))) % self.renewed
        source = np.arange(len(si)) - ages
        held = np.where(source >= 0, si[np.maximum(source, 0)], last)
        return held, (int(age + len(si)) % self.renewed, held[-1])


def columns(scenario: Scenario) -> tuple[WrittenColumn, ...]:
    """Columns of the recording.

    Raises
    ------
    InputError
        If a unit does not fit.
    """
    period = 1.0 / scenario.rig.rate
    found = [WrittenColumn("time", "s", 1.0)]
    for fitted in scenario.rig.instruments:
        target = fitted.sensor.target
        table, dimension = family(scenario.table, target), CHANNELS[target]
        step = table.quantity == "increment"
        dimension = INCREMENTS[dimension] if step else dimension
        unit, where = table.unit or UNITS[dimension], f"{scenario.path}: instrument.{family_name(target)}"
        if table.pulses and not step:
            raise InputError(f"{where}.pulses = true; wanted quantity = 'increment' with it")
        factor, _ = scale_to_si(unit, dimension, f"{where}.unit")
        logged = _logged(table, fitted.sensor.unit, period, where)
        found.append(
            WrittenColumn(
                fitted.sensor.target, unit, factor, 0.0, period if step else None, True, table.pulses, **logged
            )
        )
    for name, over_interval in (("table_angle", False), ("table_rate", True), ("temperature", False)):
        if name == "temperature" and scenario.table.temperature is None:
            continue
        turns = name == "table_angle" and scenario.rig.plant.pivots
        if name == "temperature" or scenario.table.table is not None or turns:
            unit = UNITS[CHANNELS[name]]
            factor, offset = scale_to_si(unit, CHANNELS[name], str(scenario.path))
            column = WrittenColumn(name, unit, factor, offset, over_interval=over_interval)
            found += _as_logged(column, scenario.table.table, period)
    return (*found, *_of_sight(scenario))


def _of_sight(scenario: Scenario) -> Iterator[WrittenColumn]:
    """What a vehicle's sight and level read, and whether it turns."""
    names = scenario.rig.plant.sightings
    if names:
        yield WrittenColumn("turning", "", 1.0, over_interval=True)
    for name in names:
        unit = UNITS[CHANNELS[name]]
        yield WrittenColumn(name, unit, scale_to_si(unit, CHANNELS[name], str(scenario.path))[0])


def _as_logged(column: WrittenColumn, table: TurntableTable | None, period: float) -> list[WrittenColumn]:
    """The column as the table's log has it, if it has it."""
    if table is None or column.name not in ("table_angle", "table_rate"):
        return [column]
    if column.name == "table_angle":
        return [column] if table.logged_angle else []
    return {
        "servo": [column],
        "command": [replace(column, reference="command", over_interval=False)],
        "encoder": [replace(column, reference="table_angle", per_second=1 / period)],
        "none": [],
    }[table.logged_rate]


def _logged(table: OutputTable, unit: str, period: float, where: str) -> dict[str, Any]:
    """What a logger makes of an output: gain, rows of a renewal, resolution."""
    dimension = {"rad/s": "rate", "m/s^2": "acceleration"}[unit]
    hold = given(table.renewed, "time", f"{where}.renewed", period)
    rows = round(hold / period)
    if abs(rows * period - hold) > 1e-6 * period or rows < 1:
        raise InputError(f"{where}.renewed = {table.renewed!r}; wanted a whole number of sampling periods")
    if table.quantity == "increment" and (table.gain, table.renewed, table.resolution) != (None, None, None):
        raise InputError(f"{where} has gain, renewed or resolution and increments; wanted quantity = 'rate' with them")
    return {
        "gain": 1.0 if table.gain is None else table.gain,
        "renewed": rows,
        "resolution": not_negative(table.resolution, dimension, f"{where}.resolution", 0.0),
    }


def rows(stream: Iterator[Readings], cols: Sequence[WrittenColumn], phases: Mapping[str, float]) -> Iterator[Floats]:
    """Chunks of the recording, shape (n, columns), in the columns' units.

    ``phases`` are the parts of a pulse that the counters hold at the start, or of the time to a renewal, by column.
    """
    carried: list[Carried] = [phases.get(column.name, 0.0) for column in cols]
    for readings in stream:
        chunk = np.empty((len(readings.t), len(cols)))
        for j, column in enumerate(cols):
            if column.name == "time":
                si = readings.t
            elif column.name in readings.outputs:
                si = readings.outputs[column.name]
            else:
                si = readings.references[column.reference or column.name].values
            chunk[:, j], carried[j] = column.shown(si, carried[j])
        yield chunk


def write_recording(scenario: Scenario, chunks: Iterator[Floats], path: Path, progress: Progress | None) -> None:
    """The recording in the scenario's format; text is written chunk by chunk, the binary formats at once."""
    cols = columns(scenario)
    watched = _watched(chunks, scenario.samples, progress)
    output = scenario.table.output
    with replacing(path) as temporary:
        if output.format == "csv":
            _csv(watched, cols, output.decimals, temporary)
        else:
            whole = np.concatenate(list(watched))
            WRITERS[output.format](temporary, {column.name: whole[:, j] for j, column in enumerate(cols)})


def manifest(scenario: Scenario, data: str | list[str], seed: int) -> str:
    """Text of the manifest: what is measured and declared, and nothing else."""
    table, targets = scenario.table, explained(scenario)
    tables: list[tuple[str, Mapping[str, object]]] = [
        ("", {"title": table.output.title or f"Simulated recording, seed {seed}", "data": data}),
        *((f"[channels.{column.name}]", _channel(column, table.output.format)) for column in columns(scenario)),
        ("[site]", _given(table.site)),
        ("[mounting]", _mounting(scenario)),
        ("[model]", _model(scenario)),
        *((f"[noise.{target}]", family(table, target).noise) for target in targets),
        ("[held_out]", _given(table.held_out)),
        *nested("datasheet", sheet_table(datasheet(scenario))),
    ]
    return toml(tables)


def explained(scenario: Scenario) -> tuple[str, ...]:
    """Channels that the manifest wants explained: those named; else of a vehicle that turns, the upright gyro."""
    return (_TURNED,) if scenario.rig.plant.pivots and scenario.table.model.target is None else scenario.targets


#: Gyro of a vehicle that stands along its pivot axis.
_TURNED = "gyro_z"


def _channel(column: WrittenColumn, form: str) -> dict[str, object]:
    """What the manifest says of a column; only text files bear the unit in the column's name."""
    entry: dict[str, object] = {
        "column": column.header if form == "csv" else column.name,
        **({"unit": column.unit} if column.unit else {}),
    }
    if column.increment is not None:
        return entry | {"quantity": "increment"}
    return entry | ({"covers": "interval"} if column.over_interval else {})


def _mounting(scenario: Scenario) -> Mapping[str, object]:
    """How the instruments stand: a gyro on a table, or a triad, which a vehicle turns about its upright axis."""
    if scenario.table.table is not None:
        return {"tilt": scenario.table.table.tilt or "90 deg"}
    return {"axes": "RFU"} | ({"table_axis": "U"} if scenario.rig.plant.pivots else {})


def _model(scenario: Scenario) -> dict[str, object]:
    """Targets and declared effects; nothing of the undeclared. What turns sees the Earth rate from all sides."""
    targets = explained(scenario)
    entry: dict[str, object] = {"target": targets[0] if len(targets) == 1 else list(targets)}
    declared = scenario.declared_of(targets)
    if scenario.rig.plant.pivots and scenario.table.site.latitude is not None and EarthRate.id not in declared:
        declared = (*declared, EarthRate.id)
    entry["declared"] = list(declared)
    reference = scenario.table.instrument.reference_temperature
    return entry | ({"reference_temperature": reference} if reference else {})


def _given(table: msgspec.Struct) -> dict[str, object]:
    """Entries of a table that were given, as they were given."""
    return {name: value for name, value in msgspec.structs.asdict(table).items() if value is not None}


def truth(scenario: Scenario, seed: int) -> str:
    """JSON with all that was simulated in run ``seed``, in SI units."""
    true = scenario.truth(seed)
    effects = [
        {
            "target": p.target,
            "effect": p.effect.key,
            "origin": p.origin,
            "parameters": [
                {"name": param.name, "value": value, "unit": unit}
                for param, value, unit in zip(p.effect.params, p.values, _units(p.target, p.effect), strict=True)
            ],
        }
        for p in true.planted
    ]
    document: dict[str, object] = {"schema": "insenv.truth/1", "seed": seed, "effects": effects}
    return json.dumps(document | dict(scenario.spread.shown(true.plant)), indent=1) + "\n"


def _watched(chunks: Iterator[Floats], total: int, progress: Progress | None) -> Iterator[Floats]:
    """The chunks, reported as they pass."""
    done = 0
    for chunk in chunks:
        yield chunk
        done += len(chunk)
        if progress is not None:
            progress(done, total)


def _csv(chunks: Iterator[Floats], cols: Sequence[WrittenColumn], decimals: int, path: Path) -> None:
    """Comma-separated text with one header line."""
    formats = ["%d" if c.pulses else f"%.{decimals}f" for c in cols]
    line = ",".join(formats) + "\n"
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(column.header for column in cols) + "\n")
        for chunk in chunks:
            # One format for the whole chunk: three times as fast as one for each row.
            file.write((line * len(chunk)) % tuple(chunk.ravel().tolist()))


def _units(target: str, effect: Effect) -> list[str]:
    return [param.unit.replace(OUTPUT, Sensor(target).unit) for param in effect.params]
