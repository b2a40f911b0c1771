"""Layout of a manifest: which tables and keys there are, and of which type.

TOML text -> nested tables as written, with nothing converted yet. A key that is not listed here is an error
that names the nearest one that is. Values are checked and given SI units in `insenv.data.manifest.checks`.
"""

from __future__ import annotations

import re
import tomllib
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec
from msgspec import field, inspect

from insenv.core.errors import InputError, nearest

Names = str | list[str]
Steps = tuple[str | int, ...]
Format = Literal["csv", "text", "npz", "parquet", "mat", "float64-le", "psins-imu", "xlsx", "rda", "novatel", "bag"]
T = TypeVar("T")


class TomlTable(msgspec.Struct, forbid_unknown_fields=True):
    """A TOML table that holds the listed keys and no others."""


class SourceTable(TomlTable):
    """``[source]``: where the recording comes from; informative, nothing here is fetched."""

    repository: str | None = None
    commit: str | None = None
    url: Names | None = None
    path: Names | None = None
    licence: str | None = None
    sha256: Names | None = None


class ReportTable(TomlTable):
    """``[report]``: what the head of a page says; any text, and of ``date`` a date of TOML too."""

    operator: str | None = None
    serial_number: str | int | None = None
    place: str | None = None
    date: Any = None


class ChannelTable(TomlTable):
    """One entry of ``[channels]``."""

    column: str | int | None = None
    unit: str | None = None
    quantity: Literal["rate", "increment"] | None = None
    covers: Literal["instant", "interval"] | None = None
    delay: str | None = None
    wrapped: bool = False
    rate: str | None = None
    offset: float | None = None
    file: str | None = None
    source: Literal["encoder", "command", "set"] | None = None
    nanoseconds: str | int | None = None


class SiteTable(TomlTable):
    """``[site]``."""

    latitude: str | None = None
    altitude: str | None = None
    gravity: str | None = None


class GimbalsTable(TomlTable):
    """``[mounting.gimbals]``: a table of two or three axes; see `insenv.data.manifest.gimbals`."""

    order: str
    heading: str | None = None
    mounted: str | None = None
    mounting: str | None = None
    tilt: str | None = None
    heading_error: str | None = None
    non_orthogonality: str | None = None
    eccentricity: str | None = None
    encoder_noise: str | None = None


class MountingTable(TomlTable):
    """``[mounting]``."""

    tilt: str | None = None
    axes: str | None = None
    table_axis: Literal["U", "D"] | None = None
    base_turned: str | None = None
    gimbals: GimbalsTable | None = None


class RunTable(TomlTable):
    """One ``[[runs]]`` table; what it leaves out is taken from the manifest's own tables."""

    file: str
    label: str | None = None
    table_rate: str | None = None
    temperature: str | None = None
    mounting: MountingTable = field(default_factory=MountingTable)
    site: SiteTable = field(default_factory=SiteTable)


class ModelTable(TomlTable):
    """``[model]``."""

    target: Names
    declared: list[str]
    effects: list[str] = field(default_factory=list)
    reference_temperature: str | None = None
    procedure: Literal["static", "rate-table", "multi-position"] | None = None
    bias: Literal["common", "per-run"] | None = None


class HeldOutTable(TomlTable):
    """``[held_out]``."""

    runs: list[int] | None = None
    start: str | None = None
    rows: list[tuple[int, int]] | None = None
    positions: Literal["even", "odd", "leave-one-out"] | list[int] | None = None
    averaging: str | None = None


class PositionsTable(TomlTable):
    """``[positions]``."""

    up: list[str | list[float]] = []
    tolerance: str | None = None
    repeatability: str | None = None


class FitTable(TomlTable):
    """``[fit]``."""

    rows: list[tuple[int, int]] | None = None
    resample: str | None = None


class ReadTable(TomlTable):
    """``[read]``: what of a data file is not looked at."""

    skip: int | None = None
    skip_lines: int | None = None
    incomplete: Literal["refuse", "leave out"] = "refuse"
    lines: str | None = None


class SightSheetTable(TomlTable):
    """``[datasheet.sight]``: standard deviations."""

    orientation: str | None = None
    tracking: str | None = None
    installation: str | None = None


class DatasheetTable(TomlTable):
    """``[datasheet]``: what is known before anything is measured; ``declared`` as in a scenario."""

    sampling: str | None = None
    duration: str | None = None
    pulse: str | None = None
    encoder_noise: str | None = None
    max_rate: str | None = None
    max_acceleration: str | None = None
    level: tuple[str, str] | None = None
    sight: SightSheetTable | None = None
    noise: dict[str, dict[str, str]] = field(default_factory=dict)
    declared: dict[str, Any] = field(default_factory=dict)


class ManifestTable(TomlTable):
    """The whole manifest; ``channels`` and ``noise`` are converted entry by entry, to name the faulty one."""

    model: ModelTable
    title: str | None = None
    data: Names | None = None
    runs: list[RunTable] | None = None
    format: Format | None = None
    columns: int | None = None
    channels: dict[str, Any] = field(default_factory=dict)
    site: SiteTable = field(default_factory=SiteTable)
    mounting: MountingTable = field(default_factory=MountingTable)
    noise: dict[str, Any] = field(default_factory=dict)
    held_out: HeldOutTable = field(default_factory=HeldOutTable)
    positions: PositionsTable | None = None
    fit: FitTable = field(default_factory=FitTable)
    read: ReadTable = field(default_factory=ReadTable)
    source: SourceTable | None = None
    report: ReportTable = field(default_factory=ReportTable)
    datasheet: DatasheetTable | None = None


def parse(path: Path) -> ManifestTable:
    """Tables of the manifest at ``path``.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or has an unknown key or a value of the wrong type.
    """
    tables = tree(path, "manifest")
    check_answered(tables, path)
    table = convert(tables, ManifestTable, (), path, "manifest")
    channels = {
        name: convert(v, ChannelTable, ("channels", name), path, "manifest") for name, v in table.channels.items()
    }
    noise = {name: _noise(v, ("noise", name), path) for name, v in table.noise.items()}
    return msgspec.structs.replace(table, channels=channels, noise=noise)


#: What `insenv init` writes where it has a question.
OPEN = "?"


def check_answered(tables: dict[str, Any], path: Path) -> None:
    """Refuse a manifest in which questions of `insenv init` are open.

    Raises
    ------
    InputError
        If a value in one of its tables is "?"; names all of them.
    """
    found = [key for name, value in tables.items() if isinstance(value, dict | list) for key in _open(value, (name,))]
    if not found:
        return
    noun = "an answer is" if len(found) == 1 else f"{len(found)} answers are"
    shown_keys = ", ".join(found[:8]) + (", ..." if len(found) > 8 else "")
    raise InputError(f'{path}: {noun} missing: {shown_keys}; wanted each "?" replaced, as the line above it asks')


def _open(value: object, steps: Steps) -> list[str]:
    """Dotted keys at and below ``steps`` that are open."""
    if isinstance(value, dict):
        return [key for name, one in value.items() for key in _open(one, (*steps, name))]
    if isinstance(value, list):
        return [key for i, one in enumerate(value) for key in _open(one, (*steps, i))]
    return [_dotted(steps)] if value == OPEN else []


#: Files that a user may give in place of their manifest.
DATA = {".csv", ".tsv", ".txt", ".dat", ".log", ".npz", ".npy", ".parquet", ".mat", ".imu", ".xlsx", ".rda"}


def shown(value: object) -> str:
    """Short form of ``value`` for a message: one line, at most 60 characters."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _nearest_file(path: Path) -> str:
    """Hint at the file beside that was probably meant by a name that is none; "" where there is none."""
    try:
        beside = [one.name for one in islice(path.parent.iterdir(), 1000) if one.is_file()]
    except (OSError, ValueError):
        return ""
    near = get_close_matches(path.name, beside, 1)
    return f"did you mean {str(path.with_name(near[0]))!r}?" if near and near[0] != path.name else ""


def tree(path: Path, noun: str) -> dict[str, Any]:
    """Parsed TOML of the file at ``path``, which messages call a ``noun``: "manifest", "scenario".

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    """
    if path.suffix.lower() in DATA and path.exists():
        example = f'data = "{path.name}", [channels], [model]'
        hint = f"; insenv init {path} writes one" if noun == "manifest" else ""
        raise InputError(
            f"{path}: is a file of data; wanted the {noun} that says what its columns are ({example}){hint}"
        )
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = getattr(error, "strerror", None) or error
        wanted = _nearest_file(path) or "wanted a TOML file"
        raise InputError(f"{path}: the {noun} cannot be read ({reason}); {wanted}") from None
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = content[error.start : error.start + 1].hex()
        raise InputError(f"{path}: line {line}: byte 0x{found} is not UTF-8; wanted UTF-8 text") from None
    except RecursionError:
        raise InputError(f"{path}: tables or lists are nested too deeply; wanted a {noun} in TOML") from None
    except ValueError as error:  # TOMLDecodeError, and integers too long for Python to convert
        raise InputError(f"{path}: {_syntax(str(error), content)}; wanted a {noun} in TOML") from None


def _syntax(error: str, content: bytes) -> str:
    """Clause for a TOML error, led by its line."""
    place = re.search(r" \(at (?:line (\d+), column \d+|end of document)\)", error)
    if not place:
        return f"not TOML: {error.partition(';')[0]}"
    line = place[1] or content.rstrip().count(b"\n") + 1
    return f"line {line}: not TOML: {error[: place.start()]}"


def convert(value: object, kind: type[T], prefix: Steps, path: Path, noun: str) -> T:
    """``value`` as ``kind``; ``prefix`` is where it stands in the ``noun``: "manifest", "scenario".

    Raises
    ------
    InputError
        If a key is unknown or missing, or a value has the wrong type.
    """
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise InputError(f"{path}: {_explain(str(error), value, kind, prefix, noun)}") from None


def _noise(value: object, prefix: Steps, path: Path) -> str | dict[str, str]:
    """One entry of ``[noise]``: a quantity, or the table of one target."""
    if not isinstance(value, dict):
        return convert(value, str, prefix, path, "manifest")
    return {name: convert(v, str, (*prefix, name), path, "manifest") for name, v in value.items()}


def _explain(error: str, value: object, kind: type, prefix: Steps, noun: str) -> str:
    """Sentence for msgspec's ``error``: the key as dotted path, what was found, what was wanted."""
    problem, _, place = error.partition(" - at `$")
    steps = tuple(int(n) if n else key for n, key in re.findall(r"\[(\d+)\]|\.?([^.\[\]`]+)", place))
    node = _node(steps, kind)
    if unknown := re.search(r"unknown field `(.*)`", problem, re.DOTALL):
        known = [f.name for f in node.fields] if isinstance(node, inspect.StructType) else []
        return f"unknown key {_dotted((*prefix, *steps, unknown[1]))!r}; {nearest(unknown[1], known)}"
    if missing := re.search(r"missing required field `(.*)`", problem):
        return f"the key {_dotted((*prefix, *steps, missing[1]))!r} is missing; a {noun} needs it"
    found: Any = value
    for step in steps:
        found = found[step]
    where = _dotted((*prefix, *steps)) or f"the {noun}"
    return f"{where} = {shown(found)}; wanted {_wanted(problem, node, found)}"


def _wanted(problem: str, node: inspect.Type, found: object) -> str:
    """What msgspec's ``problem`` says was expected, in words."""
    kinds = node.types if isinstance(node, inspect.UnionType) else (node,)
    if choices := [repr(v) for kind in kinds if isinstance(kind, inspect.LiteralType) for v in kind.values]:
        return f"one of {', '.join(choices)}"
    wanted = problem.partition(", got ")[0].removeprefix("Expected ").replace("`", "").replace(" | null", "")
    if wanted == "str" and isinstance(found, int | float):
        return "a text in quotation marks (a quantity with its unit)"
    words = {
        "str": "a text",
        "int": "a whole number",
        "bool": "true or false",
        "array": "a list",
        "object": "a table",
    }
    return re.sub(r"\w+", lambda m: words.get(m[0], m[0]), wanted).replace("|", "or")


def _dotted(steps: Steps) -> str:
    """Path of a key as TOML writes it."""
    return "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in steps).lstrip(".")


def _node(steps: Steps, root: type) -> inspect.Type:
    """Schema type at ``steps`` below ``root``."""
    node = inspect.type_info(root)
    for step in steps:
        for kind in node.types if isinstance(node, inspect.UnionType) else (node,):
            if isinstance(kind, inspect.StructType):
                node = next((f.type for f in kind.fields if f.name == step), node)
            elif isinstance(kind, inspect.ListType):
                node = kind.item_type
    kinds = node.types if isinstance(node, inspect.UnionType) else ()
    return next((kind for kind in kinds if isinstance(kind, inspect.StructType)), node)
