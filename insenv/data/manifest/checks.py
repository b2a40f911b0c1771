"""Values of a manifest: given SI units and checked against each other.

A value that cannot be, a key that has no meaning where it stands and two keys that contradict each other are
refused here; nothing is guessed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from datetime import date
from pathlib import Path

from insenv.core.errors import InputError, nearest
from insenv.core.filing import Filing
from insenv.core.plugins import beside, check_code
from insenv.core.recording import Mounting, Site
from insenv.core.series.allan import FLICKER, QUANTIZATION, WALK, WHITE
from insenv.core.units import quantity
from insenv.data.manifest import schema
from insenv.data.manifest.gimbals import gimbals
from insenv.data.manifest.schema import shown
from insenv.data.manifest.spec import (
    ACCELEROMETERS,
    BARE,
    CHANNELS,
    GYROS,
    PSINS_CHANNELS,
    ChannelSpec,
    HeldOut,
    KnownPositions,
    Model,
    Reading,
    RowRanges,
    RunSpec,
    Source,
)

#: Noise parameters: dimension for a gyro, for an accelerometer.
NOISE: Mapping[str, tuple[str, str]] = {
    WHITE: ("angle random walk", "velocity random walk"),
    FLICKER: ("bias instability", "acceleration"),
    WALK: ("rate random walk", "acceleration random walk"),
    QUANTIZATION: ("quantization", "velocity"),
}
#: The SI units of the same, as the field writes them.
NOISE_UNITS: Mapping[str, tuple[str, str]] = dict(
    zip(
        NOISE,
        (
            ("rad/sqrt(s)", "m/s/sqrt(s)"),
            ("rad/s", "m/s^2"),
            ("rad/s/sqrt(s)", "m/s^2/sqrt(s)"),
            ("rad", "m/s"),
        ),
        strict=True,
    )
)
#: What the field calls an accelerometer's angle random walk.
VELOCITY_RANDOM_WALK = "velocity_random_walk"
#: What a run may state of all its rows: its dimension, and the channel that it is.
STATED = {
    "table_rate": ("rate", ChannelSpec("", "rad/s", covers="interval", source="command", stated=True)),
    "temperature": ("temperature", ChannelSpec("", "K", stated=True)),
}
#: Format of a data file whose manifest names none.
SUFFIXES: Mapping[str, str] = {
    ".csv": "csv",
    ".tsv": "csv",
    ".txt": "text",
    ".dat": "text",
    ".log": "text",
    ".npz": "npz",
    ".parquet": "parquet",
    ".mat": "mat",
    ".imu": "psins-imu",
    ".xlsx": "xlsx",
    ".rda": "rda",
    ".rdata": "rda",
    ".bag": "bag",
    ".db3": "bag",
}
_EFFECT = re.compile(r"[a-z][a-z0-9_]*(:[1-9][0-9]*)?|[A-Za-z_][\w.]*:[A-Za-z_]\w*|.+\.py(:[A-Za-z_]\w*)?")
_COORDINATES = {
    "R": (1, 0, 0),
    "L": (-1, 0, 0),
    "F": (0, 1, 0),
    "B": (0, -1, 0),
    "U": (0, 0, 1),
    "D": (0, 0, -1),
}


def source(table: schema.SourceTable | None) -> Source | None:
    """Where the recording comes from, as it is said."""
    if table is None:
        return None
    return Source(
        repository=table.repository or "",
        commit=table.commit or "",
        url=_texts(table.url or []),
        path=_texts(table.path or []),
        licence=table.licence or "",
        sha256=_texts(table.sha256 or []),
    )


def report(table: schema.ReportTable, path: Path) -> Filing:
    """What the head of a page says, as texts."""
    if not isinstance(table.date, str | date | None):
        raise InputError(f"{path}: report.date = {shown(table.date)}; wanted a date or a text")
    operator, serial, place, day = (
        "" if one is None else str(one) for one in (table.operator, table.serial_number, table.place, table.date)
    )
    return Filing(operator, serial, place, day)


def _texts(value: schema.Names) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value)


def runs(table: schema.ManifestTable, folder: Path, path: Path) -> tuple[RunSpec, ...]:
    """One `RunSpec` per data file."""
    if (table.data is None) == (table.runs is None):
        found = "neither" if table.data is None else "both"
        raise InputError(f"{path}: {found} of 'data' and [[runs]] given; wanted one, to name the data files")
    tables = table.runs or [schema.RunTable(file=name) for name in _texts(table.data or [])]
    if not tables:
        raise InputError(f"{path}: data = []; wanted at least one data file")
    files = [run.file for run in tables]
    for text in (*files, *(run.label or "" for run in tables)):
        if not text.isprintable():
            raise InputError(f"{path}: {shown(text)} has control characters; wanted a printable name")
    if twice := next((name for i, name in enumerate(files) if name in files[:i]), None):
        raise InputError(f"{path}: the data file {twice!r} is named twice; wanted each run once")
    keys = [f"runs[{i}]." if table.runs else "" for i in range(len(tables))]
    for name in STATED:
        lacking = [i for i, run in enumerate(tables) if getattr(run, name) is None]
        if 0 < len(lacking) < len(tables):
            found = f"{path}: runs[{lacking[0]}] has no {name}, and other runs have one"
            raise InputError(f"{found}; wanted it in each of them, or in none")
    return tuple(
        RunSpec(
            file=folder / run.file,
            format=_format(run.file, table.format, path),
            label=run.label or Path(run.file).name,
            mounting=_mounting(run.mounting, table.mounting, f"{path}: {key}mounting"),
            site=_site(run.site, table.site, f"{path}: {key}site"),
            reading=_reading(table.read, path),
            stated=tuple(
                (name, _stated_value(name, text, f"{path}: {key}{name}"))
                for name in STATED
                if (text := getattr(run, name)) is not None
            ),
        )
        for run, key in zip(tables, keys, strict=True)
    )


def _stated_value(name: str, text: str, where: str) -> float:
    value = quantity(text, STATED[name][0], where)
    if name == "temperature":
        _within(value, (0.0, math.inf), f"{where} = {text!r}", "no less than absolute zero")
    return value


def _reading(table: schema.ReadTable, path: Path) -> Reading:
    for key in ("skip", "skip_lines"):
        if (getattr(table, key) or 0) < 0:
            raise InputError(f"{path}: read.{key} = {getattr(table, key)}; wanted a number from 0")
    if table.lines is not None and not re.fullmatch(r"\S+", table.lines):
        raise InputError(f"{path}: read.lines = {table.lines!r}; wanted the first word of the lines that are rows")
    return Reading(table.skip or 0, table.skip_lines or 0, table.incomplete == "leave out", table.lines or "")


def _format(file: str, declared: str | None, path: Path) -> str:
    """Format of ``file``: as declared, else by its suffix."""
    suffix = Path(file).suffix.lower()
    if declared is None and suffix not in SUFFIXES:
        known = ", ".join(SUFFIXES)
        raise InputError(f"{path}: the data file {file!r} needs a 'format'; known without one are {known}")
    return declared or SUFFIXES[suffix]


def _mounting(run: schema.MountingTable, shared: schema.MountingTable, where: str) -> Mounting:
    tilt, axes = run.tilt or shared.tilt, run.axes or shared.axes or Mounting.axes
    if tilt is not None:
        elevation = quantity(tilt, "angle", f"{where}.tilt")
        _within(elevation, (-math.pi / 2, math.pi / 2), f"{where}.tilt = {tilt!r}", "from -90 deg to 90 deg")
    letters = [_COORDINATES.get(letter, (0, 0, 0)) for letter in axes]
    if len(letters) != 3 or _triple_product(*letters) != 1:
        raise InputError(f"{where}.axes = {axes!r}; wanted a right-handed triad such as RFU, FRD or FLU")
    table_axis = run.table_axis or shared.table_axis
    if table_axis is not None and tilt is not None:
        raise InputError(f"{where} has tilt and table_axis; wanted tilt of a single gyro, or table_axis of a triad")
    turned = run.base_turned or shared.base_turned
    base_turned = 0.0 if turned is None else quantity(turned, "angle", f"{where}.base_turned")
    table = run.gimbals or shared.gimbals
    return Mounting(
        Mounting.tilt if tilt is None else elevation,
        axes,
        table_axis or Mounting.table_axis,
        base_turned,
        None if table is None else gimbals(table, f"{where}.gimbals"),
    )


def _triple_product(a: tuple[int, ...], b: tuple[int, ...], c: tuple[int, ...]) -> int:
    return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3))


def _site(run: schema.SiteTable, shared: schema.SiteTable, where: str) -> Site:
    limits = {  # gravity at the Earth's surface is 9.76 to 9.83 m/s^2
        "latitude": ("angle", (-math.pi / 2, math.pi / 2), "from -90 deg to 90 deg"),
        "altitude": ("length", (-12e3, 100e3), "from -12 km to 100 km"),
        "gravity": ("acceleration", (9.4, 10.0), "the local gravity, from 9.4 m/s^2 to 10 m/s^2"),
    }
    given: dict[str, float] = {}
    for name, (dimension, limit, wanted) in limits.items():
        text = getattr(run, name) or getattr(shared, name)
        if text is not None:
            given[name] = quantity(text, dimension, f"{where}.{name}")
            _within(given[name], limit, f"{where}.{name} = {text!r}", wanted)
    return Site(**given)


def _within(value: float, limits: tuple[float, float], what: str, wanted: str) -> None:
    """Refuse a value outside ``limits``; a unit's rounding may carry a value just past one."""
    low, high = limits
    if not low - 1e-9 <= value <= high + 1e-9:
        raise InputError(f"{what}; wanted {wanted}")


def channels(
    table: schema.ManifestTable, runs: tuple[RunSpec, ...], path: Path, folder: Path = Path()
) -> dict[str, ChannelSpec]:
    """Channels in the manifest's order; a PSINS log has its own where none are listed."""
    psins = all(run.format == "psins-imu" for run in runs)
    tables = table.channels
    if psins and not tables.keys() - {"time"}:
        tables = {**tables, **{name: schema.ChannelTable() for name in PSINS_CHANNELS}}
    for name in tables:
        if name not in CHANNELS:
            raise InputError(f"{path}: unknown channel {name!r} in [channels]; {nearest(name, CHANNELS)}")
    if "time" not in tables and "segment" in tables and tables["segment"].column == "row":
        tables = {"time": schema.ChannelTable(column="row"), **tables}
    if "time" not in tables and not psins:
        raise InputError(f'{path}: channels.time is missing; wanted its column, its rate as in "100 Hz", or "row"')
    found = {name: _channel(name, spec, f"{path}: channels.{name}") for name, spec in tables.items()}
    own = {name: spec.file for name, spec in tables.items() if spec.file is not None}
    if own and len(runs) > 1:
        raise InputError(f"{path}: channels.{next(iter(own))}.file is for one run; there are {len(runs)}")
    beside = {
        name: replace(found[name], file=folder / file, format=_format(file, table.format, path))
        for name, file in own.items()
    }
    return found | beside | _stated(runs, tables, path)


def _stated(runs: tuple[RunSpec, ...], tables: Mapping[str, schema.ChannelTable], path: Path) -> dict[str, ChannelSpec]:
    """Channels of which each run states the value."""
    names = [name for name, _ in runs[0].stated]
    if twice := next((name for name in names if name in tables), None):
        raise InputError(f"{path}: runs[0].{twice} is stated, and channels.{twice} has a column; wanted one of them")
    return {name: STATED[name][1] for name in names}


def _channel(name: str, table: schema.ChannelTable, where: str) -> ChannelSpec:
    """One channel; refuses keys that mean nothing on it."""
    _refuse_keys(name, table, where)
    column = name if table.column is None else table.column
    if isinstance(column, int) and column < 0:
        raise InputError(f"{where}.column = {column}; wanted an index from 0, or a name")
    if table.quantity == "increment" and table.covers == "instant":
        raise InputError(f"{where}.covers = 'instant'; an increment always covers its interval")
    if name == "time" and table.rate is not None and (table.column is not None or table.unit is not None):
        raise InputError(f"{where} has a rate and a column or unit; wanted either rate or column with unit")
    if name == "temperature" and table.source not in (None, "set"):
        wanted = "'set', of temperatures that were waited for, or none"
        raise InputError(f"{where}.source = {table.source!r}; wanted {wanted}")
    delay = 0.0 if table.delay is None else quantity(table.delay, "time", f"{where}.delay")
    rate = None if table.rate is None else _positive(table.rate, "frequency", f"{where}.rate")
    offset = table.offset or 0.0
    if not math.isfinite(offset):
        raise InputError(f"{where}.offset = {offset}; wanted what the file shows at zero input")
    unit = table.unit
    if table.nanoseconds is not None:
        if table.rate is not None or unit not in (None, "s"):
            raise InputError(f"{where} has nanoseconds; wanted a column of whole seconds beside them, unit 's' or none")
        unit = "s"
    return ChannelSpec(
        column,
        unit,
        table.quantity,
        table.covers,
        delay,
        table.wrapped,
        rate,
        offset,
        source=table.source,
        nanoseconds=table.nanoseconds,
    )


def _refuse_keys(name: str, table: schema.ChannelTable, where: str) -> None:
    rate_type = (*GYROS, *ACCELEROMETERS, "table_rate")
    meant_for: dict[str, tuple[str, ...]] = {
        "rate": ("time",),
        "nanoseconds": ("time",),
        "wrapped": ("table_angle",),
        "source": ("table_angle", "table_rate", "temperature"),
        "quantity": rate_type,
        "covers": (*rate_type, "turning"),
        "offset": rate_type,
        "file": tuple(n for n in CHANNELS if n not in ("time", *BARE)),
        "delay": tuple(n for n in CHANNELS if n not in ("time", *BARE)),
        "unit": tuple(n for n in CHANNELS if n not in BARE),
    }
    for key, names in meant_for.items():
        if getattr(table, key) not in (None, False) and name not in names:
            raise InputError(f"{where}.{key} has no meaning on this channel; it belongs to {', '.join(names)}")


def _positive(text: str, dimension: str, where: str) -> float:
    value = quantity(text, dimension, where)
    if not value > 0:
        raise InputError(f"{where} = {text!r}; wanted more than zero")
    return value


def model(table: schema.ModelTable, channels: Mapping[str, ChannelSpec], path: Path) -> Model:
    """What is to be explained; every target must be an instrument among the channels."""
    targets = _texts(table.target)
    instruments = [name for name in channels if name in (*GYROS, *ACCELEROMETERS)]
    for target in targets:
        if target not in instruments:
            hint = nearest(target, instruments)
            raise InputError(f"{path}: model.target = {target!r} is no instrument in [channels]; {hint}")
    if not targets:
        raise InputError(f"{path}: model.target = []; wanted at least one channel")
    for key, effects in (("declared", table.declared), ("effects", table.effects)):
        for effect in effects:
            if not _EFFECT.fullmatch(effect):
                wanted = "wanted a name, name:order, module:Name or file.py"
                raise InputError(f"{path}: model.{key} has {shown(effect)}; {wanted}")
            check_code(effect, f"{path}: model.{key}")
    lists = {"target": targets, "declared": tuple(table.declared), "effects": tuple(table.effects)}
    for key, names in lists.items():
        if len(set(names)) < len(names):
            raise InputError(f"{path}: model.{key} = {shown(list(names))}; wanted each name once")
    reference, where = table.reference_temperature, f"{path}: model.reference_temperature"
    kelvin = Model.reference_temperature if reference is None else _positive(reference, "temperature", where)
    declared, more = (tuple(beside(e, path.parent) for e in lists[key]) for key in ("declared", "effects"))
    return Model(targets, declared, kelvin, table.procedure, table.bias, more)


def noise(table: schema.ManifestTable, targets: tuple[str, ...], path: Path) -> dict[str, dict[str, float]]:
    """Declared noise of each target: what stands in ``[noise]``, overruled by the target's own sub-table."""
    noise: dict[str, dict[str, float]] = {target: {} for target in targets}
    # Of a unit's data sheet some is of channels that are no targets.
    others: dict[str, dict[str, float]] = {name: {} for name in table.channels if name in (*GYROS, *ACCELEROMETERS)}
    for name, value in table.noise.items():
        if isinstance(value, str):
            _declare(noise, name, value, f"{path}: noise.{name}", others)
        elif name not in noise:
            raise InputError(f"{path}: [noise.{name}] is not a target of the model; {nearest(name, targets)}")
    for target, own in table.noise.items():
        if isinstance(own, dict):
            for name, value in own.items():
                _declare({target: noise[target]}, name, value, f"{path}: noise.{target}.{name}", {})
    return noise


def _declare(
    noise: dict[str, dict[str, float]],
    name: str,
    text: str,
    where: str,
    others: dict[str, dict[str, float]],
) -> None:
    """Enter one noise parameter for those targets whose dimension it has; there must be one, or one of ``others``."""
    slot = WHITE if name == VELOCITY_RANDOM_WALK else name
    if slot not in NOISE:
        raise InputError(f"{where}: unknown noise parameter; {nearest(name, [*NOISE, VELOCITY_RANDOM_WALK])}")
    failed: InputError | None = None
    entered = False
    for target, parameters in (*noise.items(), *others.items()):
        is_accelerometer = target in ACCELEROMETERS
        if name == VELOCITY_RANDOM_WALK and not is_accelerometer:
            continue
        try:
            parameters[slot] = _not_negative(text, NOISE[slot][is_accelerometer], where)
            entered = True
        except InputError as error:
            failed = error
    if not entered:
        raise failed or InputError(f"{where}: no target is an accelerometer; of a gyro say angle_random_walk")


def _not_negative(text: str, dimension: str, where: str) -> float:
    value = quantity(text, dimension, where)
    if not value >= 0:
        raise InputError(f"{where} = {text!r}; wanted zero or more")
    return value


def held_out(table: schema.HeldOutTable, n_runs: int | None, path: Path) -> HeldOut:
    """Held-out data; at most one way to name them. ``n_runs`` is None where the data tell how many runs there are."""
    given = [k for k in ("runs", "start", "rows", "positions") if getattr(table, k) is not None]
    if len(given) > 1:
        raise InputError(f"{path}: [held_out] has {' and '.join(given)}; wanted one of them")
    runs = tuple(table.runs or ())
    for run in runs:
        if not 1 <= run <= (n_runs or run):
            wanted = f"runs from 1 to {n_runs}" if n_runs else "runs, counted from 1"
            raise InputError(f"{path}: held_out.runs has {run}; wanted {wanted}")
    for name in ("runs", "rows"):
        if getattr(table, name) == []:
            raise InputError(f"{path}: held_out.{name} = []; wanted at least one, or no such key")
    where = f"{path}: held_out"
    return HeldOut(
        runs=runs,
        start=None if table.start is None else _not_negative(table.start, "time", f"{where}.start"),
        rows=ranges(table.rows, f"{where}.rows"),
        positions=_positions(table.positions, f"{where}.positions"),
        averaging=None if table.averaging is None else _positive(table.averaging, "time", f"{where}.averaging"),
    )


def _positions(given: str | list[int] | None, where: str) -> str | tuple[int, ...] | None:
    """Rests by "even" or "odd", or by their numbers."""
    if given is None or isinstance(given, str):
        return given
    if not given or min(given) < 1:
        raise InputError(f"{where} = {given}; wanted 'even', 'odd' or rests, counted from 1")
    return tuple(given)


def positions(table: schema.PositionsTable | None, procedure: str | None, path: Path) -> KnownPositions | None:
    """Stated attitudes and repeatability of the rests."""
    if table is None:
        return None
    if procedure != "multi-position":
        raise InputError(f"{path}: [positions] needs model.procedure = 'multi-position'")
    if not table.up and table.repeatability is None:
        raise InputError(f"{path}: [positions] states nothing; wanted up or repeatability")
    stated = KnownPositions(tuple(_direction(given, f"{path}: positions.up") for given in table.up))
    if table.tolerance is not None:
        stated = replace(stated, tolerance=_positive(table.tolerance, "angle", f"{path}: positions.tolerance"))
    if table.repeatability is not None:
        where = f"{path}: positions.repeatability"
        stated = replace(stated, repeatability=_positive(table.repeatability, "acceleration", where))
    return stated


def _direction(given: str | list[float], where: str) -> tuple[float, float, float]:
    """Unit vector of "+x", "-z" or a vector of any length."""
    wanted = "wanted an axis such as '+x' or '-z', or three numbers"
    if isinstance(given, str):
        sign, name = (-1.0 if given.startswith("-") else 1.0), given.lstrip("+-")
        if name not in ("x", "y", "z") or len(given) > 2:
            raise InputError(f"{where} has {shown(given)}; {wanted}")
        x, y, z = (sign * (name == axis) for axis in "xyz")
        return (x, y, z)
    size = math.hypot(*given)
    if len(given) != 3 or not (math.isfinite(size) and size > 0):
        raise InputError(f"{where} has {shown(given)}; {wanted}")
    return (given[0] / size, given[1] / size, given[2] / size)


def resample(table: schema.ManifestTable, n_runs: int, path: Path) -> float | None:
    """Rate of the means that stand for uneven rows [Hz]."""
    if table.fit.resample is None:
        return None
    for key, rows in (("held_out", table.held_out.rows), ("fit", table.fit.rows)):
        if rows is not None and n_runs > 1:
            found = f"{key}.rows beside fit.resample, which makes other rows of {n_runs} runs"
            raise InputError(f"{path}: {found}; wanted held_out.start, or one run")
    return _positive(table.fit.resample, "frequency", f"{path}: fit.resample")


def ranges(rows: list[tuple[int, int]] | None, where: str) -> RowRanges:
    """Half-open ranges of rows."""
    for start, stop in rows or ():
        if not 0 <= start < stop:
            raise InputError(f"{where} has [{start}, {stop}]; wanted [first, last + 1], counted from 0")
    return tuple(rows or ())


def columns(table: schema.ManifestTable, runs: tuple[RunSpec, ...], path: Path) -> int | None:
    """Number of values in a row of float64-le files, which nothing else tells."""
    binary = any(run.format == "float64-le" for run in runs)
    if not binary and table.columns is not None:
        raise InputError(f"{path}: columns = {table.columns} belongs to format = 'float64-le' alone")
    if binary and (table.columns is None or table.columns < 1):
        raise InputError(f"{path}: columns = {table.columns}; wanted the number of values in a row of float64-le")
    return table.columns
