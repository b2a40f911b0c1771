"""Manifest -> recordings in SI units, chunk by chunk: a file may be longer than memory.

CSV, NumPy archives and rows of float64 are read in chunks; other formats are read whole and dealt out in the same way.
The checks are those of `insenv.data.load`, each within its chunk and over the boundary to the one before.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Recording, Segment
from insenv.data import load, readers
from insenv.data.manifest import Manifest, RunSpec
from insenv.data.manifest.spec import Reading
from insenv.data.readers import Column, Table, binary, check_table, text
from insenv.data.readers.arrays import matrix_of
from insenv.data.readers.rows import read_rows
from insenv.data.readers.table import as_labels, as_numbers, decoding, find_column

#: Rows of a chunk, and bytes of one of a text file.
ROWS, BYTES = 262_144, 4_000_000

Dealt = Iterator[tuple[Table, float]]


def stream_run(
    manifest: Manifest, run: RunSpec, progress: Callable[[float], None] = lambda share: None
) -> Iterator[Recording]:
    """The recording of one run in chunks, as `insenv.data.load.read_recordings` would read it in one.

    ``progress`` is told what share of the file is done. In a recording with labels a chunk without any has one empty
    segment.

    Raises
    ------
    InputError
        As `read_recordings`.
    """
    seen = _Seen()
    if own := [name for name, spec in manifest.channels.items() if spec.file is not None]:
        raise InputError(f"{manifest.path}: channels.{own[0]}.file cannot be streamed; wanted one file for all")
    for table, share in _tables(run, load.columns(manifest), manifest.columns):
        recording, seen = _recording(manifest, run, load.with_stated(run, table), seen)
        progress(share)
        yield recording
    if seen.rows < 2:
        raise InputError(f"{run.file}: has {seen.rows} row of data; wanted at least 2")


@dataclass(frozen=True)
class _Seen:
    """Of the chunks before: rows, last time [s], sampling period [s], last table angle made whole [rad], power-up."""

    rows: int = 0
    t: float | None = None
    dt: float | None = None
    angle: float | None = None
    power: float = 1.0


def _recording(manifest: Manifest, run: RunSpec, table: Table, seen: _Seen) -> tuple[Recording, _Seen]:
    t = load.time(manifest, run, table, seen.rows)
    if seen.t is None:
        load.check_sampling(run.file, t, table.place)
    elif len(t) > 1:
        load.check_sampling(run.file, np.append(seen.t, t), lambda row: table.place(row - 1))
    dt = Recording(t, {}).dt if seen.dt is None else seen.dt
    recording = load.recording(manifest, run, table, t, dt, seen.rows)
    if "segment" in manifest.channels and not recording.segments:
        recording = replace(recording, segments=(Segment("", 0, 0),))
    angle, power = None, seen.power
    if "table_angle" in recording.channels:
        recording = _continued(recording, manifest.channels["table_angle"].wrapped, seen.angle)
        angle = float(recording.channels["table_angle"].values[-1])
    if "power" in recording.channels:
        load.check_power(run.file, recording.channels["power"].values, table.place, seen.power)
        power = float(recording.channels["power"].values[-1])
    return recording, _Seen(seen.rows + len(t), float(t[-1]), dt, angle, power)


def _continued(recording: Recording, wrapped: bool, last: float | None) -> Recording:
    """A wrapped angle goes on from the chunk before."""
    if not wrapped or last is None:
        return recording
    channel = recording.channels["table_angle"]
    turn = 2 * np.pi
    values = channel.values + turn * np.round((last - channel.values[0]) / turn)
    return replace(recording, channels={**recording.channels, "table_angle": replace(channel, values=values)})


def _tables(run: RunSpec, columns: Sequence[Column], width: int | None) -> Dealt:
    """Chunks of the file, checked, and the share of it that is done after each."""
    path = run.file
    chunked: dict[str, Callable[[], Dealt | None]] = {
        "csv": lambda: _csv(path, columns, run.reading),
        "npz": lambda: _npz(path, columns),
        "float64-le": lambda: _float64(path, columns, width or 1),
    }
    dealt = None
    plain = not run.reading.skip and not run.reading.incomplete
    if path.is_file() and run.format in chunked and plain:
        try:
            dealt = chunked[run.format]()
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    if dealt is None:
        dealt = _whole(readers.read_table(run, columns, width), columns)
    for table, share in dealt:
        check_table(path, columns, table)
        yield table, share


def _whole(table: Table, columns: Sequence[Column]) -> Dealt:
    """A table that was read in one piece."""
    n = len(table)
    for start in range(0, max(n, 1), ROWS):
        yield _part(table, start, min(start + ROWS, n), columns), min((start + ROWS) / max(n, 1), 1.0)


def _part(table: Table, start: int, stop: int, columns: Sequence[Column]) -> Table:
    values = {c.channel: table.values[c.channel][start:stop] for c in columns if not c.label}
    labels = {c.channel: table.labels[c.channel][start:stop] for c in columns if c.label}
    t = None if table.t is None else table.t[start:stop]
    index = None if table.index is None else table.index[start:stop]
    return replace(table, values=values, labels=labels, t=t, index=index, place=lambda row: table.place(row + start))


def _float64(path: Path, columns: Sequence[Column], width: int) -> Dealt | None:
    """Rows of float64."""
    size = path.stat().st_size
    if size % (8 * width) or size <= 8 * width * ROWS or any(c.label or isinstance(c.key, str) for c in columns):
        return None  # small, or at fault: the whole reader says what

    rows, names = size // (8 * width), [str(i) for i in range(width)]

    def deal() -> Dealt:
        for start in range(0, rows, ROWS):
            values = np.fromfile(path, "<f8", width * ROWS, offset=8 * width * start).reshape(-1, width)
            at = {c.channel: find_column(path, names, c) for c in columns}
            table = Table({name: values[:, j].copy() for name, j in at.items()})
            for column in columns:
                binary.check_order(path, column, table.values[column.channel], start)
            yield _shifted(table, start), min((start + ROWS) / rows, 1.0)

    return deal()


def _shifted(table: Table, start: int) -> Table:
    """A table whose row 0 is row ``start`` of the file."""
    return replace(table, place=lambda row: f"row {row + start}")


def _csv(path: Path, columns: Sequence[Column], reading: Reading) -> Dealt | None:
    """Text with a header line; None where it is short, or no line of it can be told by its bytes."""
    size = path.stat().st_size
    if size <= BYTES or reading.lines or text.is_wide(path):
        return None
    return _csv_chunks(path, columns, size, reading)


def _csv_chunks(path: Path, columns: Sequence[Column], size: int, reading: Reading) -> Dealt:
    with path.open("rb") as file:
        first = file.read(BYTES // 4) + file.readline()
        body = text.below_header(path, first, columns, reading.skip_lines)
        while body.content or (body := replace(body, content=file.read(BYTES) + file.readline())).content:
            if body.content.strip():
                yield read_rows(body, columns), file.tell() / size
            body = replace(body, content=b"", first=body.first + len(body.content.splitlines()))


def _npz(path: Path, columns: Sequence[Column]) -> Dealt | None:
    """Arrays of a NumPy archive; None where one cannot be read row by row."""
    if not zipfile.is_zipfile(path) or any(isinstance(c.key, int) for c in columns):
        return None
    with zipfile.ZipFile(path) as archive:
        names = {n.removesuffix(".npy") for n in archive.namelist()}
    arrays = {c: c.key if c.key in names else matrix_of(str(c.key)) for c in columns}
    if not set(arrays.values()) <= names:
        return None
    return _npz_chunks(path, arrays) if _rows_of(path, set(map(str, arrays.values()))) else None


def _rows_of(path: Path, names: set[str]) -> bool:
    """Whether all arrays are long, equally long, and stored row by row."""
    with zipfile.ZipFile(path) as archive, decoding(path, "npz"):
        heads = []
        for name in names:
            with archive.open(f"{name}.npy") as member:
                heads.append(_head(member))
    shapes = {shape[0] if shape else 0 for shape, _, _ in heads}
    sound = all(not dtype.hasobject and len(shape) in (1, 2) and not columnwise for shape, columnwise, dtype in heads)
    return sound and len(shapes) == 1 and shapes.pop() > ROWS


def _head(member: Any) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, whether stored column by column, type."""
    version = np.lib.format.read_magic(member)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, columnwise, dtype = read(member)
    return shape, columnwise and len(shape) > 1, dtype


def _npz_chunks(path: Path, arrays: Mapping[Column, str | int]) -> Dealt:
    with ExitStack() as stack, decoding(path, "npz"):
        archive = stack.enter_context(zipfile.ZipFile(path))
        members = {name: stack.enter_context(archive.open(f"{name}.npy")) for name in set(arrays.values())}
        heads = {name: _head(member) for name, member in members.items()}
        total = next(iter(heads.values()))[0][0]
        for start in count(0, ROWS):
            n = min(ROWS, total - start)
            if n <= 0:
                return
            parts = {name: _read(member, heads[name], n) for name, member in members.items()}
            picked = {c: _column(path, c, parts[name], name) for c, name in arrays.items()}
            values = {c.channel: as_numbers(path, c, a) for c, a in picked.items() if not c.label}
            labels = {c.channel: as_labels(path, c, a) for c, a in picked.items() if c.label}
            yield _shifted(Table(values, labels), start), (start + n) / total


def _read(member: Any, head: tuple[tuple[int, ...], bool, np.dtype[Any]], n: int) -> Any:
    shape, _, dtype = head
    wide = int(np.prod(shape[1:], dtype=int))
    content = member.read(n * wide * dtype.itemsize)
    return np.frombuffer(content, dtype).reshape(n, *shape[1:])


def _column(path: Path, column: Column, array: Any, name: str | int) -> Any:
    """The column of a matrix that ``column`` asks for."""
    if column.key == name:
        return array
    index = int(str(column.key)[len(str(name)) + 1 : -1])
    if array.ndim != 2 or index >= array.shape[1]:
        raise InputError(f"{path}: no {column}; its array has shape {array.shape}")
    return array[:, index]
