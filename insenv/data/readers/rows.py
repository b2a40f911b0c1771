"""Rows of a text table -> columns of numbers and labels.

Libraries read a sound file fast; where they refuse, or are not there, the standard library reads it again,
row by row, and finds the line at fault. Only the wanted columns need be numbers; all rows are of one width.

Loggers leave lines that are no rows, which are passed over and told: comments between the rows, the header once more
where a logger went on, and a last line that was cut off as it stopped. A cell in quotation marks may go on in the next
lines, as an array does that was printed into it.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.data.manifest.schema import shown
from insenv.data.manifest.spec import CHANNELS, EVENTS
from insenv.data.readers.conventions import unit_of
from insenv.data.readers.stamps import second, seconds
from insenv.data.readers.table import Column, Table, find_column, split_unit

#: Rows after which what was read so far is looked at.
EARLY = 1000
#: What a line begins with that is a comment.
COMMENTS = ("#", "%", "//")
#: Rows before a last one from which on it is cut off, and not a table of two widths.
ENOUGH = 8
#: Columns from which on a line of words is told to be headings.
LEAST_HEADINGS = 2
#: Lines of one row; where a cell goes on for more its quotation mark is not closed.
MOST_LINES = 100
_UNDECODABLE = "\N{REPLACEMENT CHARACTER}"
_Columns = dict[Column, Any]


class HeadingsError(InputError):
    """Columns have other names or units from a line on: no way of reading the file makes one table of it."""


@dataclass(frozen=True)
class Body:
    """Rows below the header: ``content`` begins at line ``first``; ``names`` has one entry per column.

    With ``incomplete`` a value that is missing or no number is read as NaN.
    """

    path: Path
    content: bytes
    first: int
    delimiter: str | None
    names: Sequence[str]
    incomplete: bool = False

    def text(self) -> io.TextIOWrapper:
        """The rows as text with plain line breaks; what cannot be decoded is marked."""
        return io.TextIOWrapper(io.BytesIO(self.content), "utf-8", "replace", newline=None)


def read_rows(body: Body, columns: Sequence[Column]) -> Table:
    """Wanted columns of ``body``.

    Raises
    ------
    InputError
        If there are no rows, a row is of another width, or a wanted cell is no number; names the line.
    """
    at = {column: find_column(body.path, body.names, column) for column in columns}
    stamped = _stamped(body, at)
    cells = {replace(column, label=True) if column in stamped else column: i for column, i in at.items()}
    fast = _with_numpy if body.delimiter is None else _with_arrow
    notes: list[str] = []
    behind: list[str] = []
    found = fast(body, cells) or _with_python(body, cells, notes, behind)
    units = {column.channel: unit for column, i in at.items() if (unit := unit_of(body.names, i))}
    for column in stamped:
        found[column] = _seconds(body, column, found.pop(replace(column, label=True)))
        units[column.channel] = "s"
    return Table(
        values={column.channel: data for column, data in found.items() if not column.label},
        labels={column.channel: data for column, data in found.items() if column.label},
        units=units,
        place=partial(_place, body),
        word=partial(_word, body, {column.channel: i for column, i in at.items()}),
        notes=tuple(notes),
        behind=tuple(behind),
        stamped=frozenset(column.channel for column in stamped),
    )


def _stamped(body: Body, at: dict[Column, int]) -> list[Column]:
    """Columns of time that hold dates or times of day, as the first row shows."""
    may = [column for column in at if not column.label and (column.channel == "time" or column.channel not in CHANNELS)]
    first = next(_rows(body), (0, []))[1] if may else []
    return [c for c in may if at[c] < len(first) and not is_number(first[at[c]]) and second(first[at[c]]) >= 0]


def _seconds(body: Body, column: Column, cells: list[str]) -> Floats:
    """Stamps of a column [s].

    Raises
    ------
    InputError
        If a cell is none, and incomplete rows are refused; names its line.
    """
    found = seconds(cells)
    if not body.incomplete and not np.isfinite(found).all():
        row = int(np.argmin(np.isfinite(found)))
        given = f"{_place(body, row)}: {column} is {shown(cells[row])}"
        raise InputError(f"{body.path}: {given}; wanted a date or a time of day as in the first row")
    return found


def is_number(cell: str) -> bool:
    """Whether ``cell`` is a number as files write one (Python's ``1_000`` is not)."""
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _with_arrow(body: Body, at: dict[Column, int]) -> _Columns | None:
    """Columns read by pyarrow, ten times as fast as by Python; None where it refuses or is not there."""
    try:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv
    except ImportError:
        return None
    if b'"' in body.content:
        return None  # it would take a quotation mark that is never closed for a cell that ends with the file
    names = [str(i) for i in range(len(body.names))]
    kinds = {str(i): pa.string() if column.label else pa.float64() for column, i in at.items()}
    if any(column.label != (kinds[str(i)] == pa.string()) for column, i in at.items()):
        return None  # one column as numbers and as labels
    try:
        table = arrow_csv.read_csv(
            pa.BufferReader(body.content),
            read_options=arrow_csv.ReadOptions(column_names=names),
            parse_options=arrow_csv.ParseOptions(delimiter=body.delimiter),
            # An empty cell is an error, not a missing value.
            convert_options=arrow_csv.ConvertOptions(
                include_columns=list(kinds), column_types=kinds, null_values=[], strings_can_be_null=False
            ),
        )
    except (pa.ArrowException, OSError):
        return None
    return {
        column: [label.strip() for label in table.column(str(i)).to_pylist()]
        if column.label
        else np.concatenate([np.zeros(0), *(_of_arrow(chunk) for chunk in table.column(str(i)).chunks if len(chunk))])
        for column, i in at.items()
    }


def _of_arrow(chunk: Any) -> Floats:
    """Of an Arrow array of numbers without missing ones; its own ``to_numpy`` imports pandas first."""
    return np.frombuffer(chunk.buffers()[1], np.float64, len(chunk), 8 * chunk.offset)


def _with_numpy(body: Body, at: dict[Column, int]) -> _Columns | None:
    """Columns read by NumPy where the whole table is of numbers; None where it refuses."""
    if any(column.label for column in at) or not body.content.strip():
        return None
    try:
        rows = np.loadtxt(body.text(), comments=None, ndmin=2)  # all columns, so that ragged rows are found
    except ValueError:
        return None
    if rows.shape[1] != len(body.names):
        return None
    return {column: np.ascontiguousarray(rows[:, i]) for column, i in at.items()}


def _with_python(body: Body, at: dict[Column, int], notes: list[str], behind: list[str]) -> _Columns:
    """Columns read by the standard library, which knows every row's line.

    A word on what was passed over between the rows goes into ``notes``, on a last line into ``behind``.
    """
    lines, rows = [], []
    passed: list[int] = []
    wanted_columns = [i for column, i in at.items() if not column.label]
    for line, cells in _sound(body, wanted_columns, passed, behind):
        if len(cells) != len(body.names) and body.incomplete:
            cells = [""] * len(body.names)
        elif len(cells) != len(body.names):
            wanted = f"wanted {len(body.names)} as in the first line"
            raise InputError(f"{body.path}: line {line}: a row of {len(cells)} values; {wanted}")
        lines.append(line)
        rows.append(cells)
        if len(rows) == EARLY:
            _columns(body, at, rows, lines)  # a fault at the beginning is told before the rest is gone through
    if not rows:
        raise InputError(f"{body.path}: has no rows of data; wanted at least one")
    if passed:
        noun = "1 line is" if len(passed) == 1 else f"{len(passed)} lines are"
        notes.append(f"{noun} a comment or the header again, the first line {passed[0]}: passed over")
    return _columns(body, at, rows, lines)


def _sound(body: Body, numbers: Sequence[int], passed: list[int], behind: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Rows without the lines that are none: numbers of those go to ``passed``, a word on the last one to ``behind``.

    A last line is cut off that has fewer cells than all others, or ends within a number; a file that was closed ends
    with a line break. Where incomplete rows are left out it is one of these.
    """
    header = [name.strip() for name in body.names]
    whole = body.content.endswith((b"\n", b"\r"))
    before: tuple[int, list[str]] | None = None
    count = 0
    for line, cells in _rows(body):
        if _is_no_row(cells, header, numbers):
            passed.append(line)
            continue
        if (other := _other_heading(cells, header)) is not None:
            found = f"line {line}: another header ({shown(cells[other].strip())} for {shown(header[other])})"
            raise HeadingsError(
                f"{body.path}: {found}; wanted the columns and units of the first one, or a file for each"
            )
        if before is not None:
            yield before
        before = line, cells
        count += 1
    if before is None:
        return
    line, cells = before
    short = len(cells) < len(header)
    broken = not short and not whole and any(not is_number(cells[i]) for i in numbers if i < len(cells))
    if (short or broken) and count > ENOUGH and not body.incomplete:
        behind.append(f"the last line, {line}, is cut off: passed over")
        return
    yield before


def _is_no_row(cells: list[str], header: Sequence[str], numbers: Sequence[int]) -> bool:
    """Whether a line is a comment, or the header once more."""
    if cells[0].lstrip().startswith(COMMENTS):
        return len(cells) != len(header) or any(not is_number(cells[i]) for i in numbers if i < len(cells))
    return not header[0].isdigit() and [cell.strip() for cell in cells] == header


def _other_heading(cells: list[str], header: Sequence[str]) -> int | None:
    """The first column that a line of headings gives another name or unit; None of a line that is none.

    Who appends a file to another, or starts a logger anew with other settings, leaves such a line. Most of its cells
    are headings of the first one, their units apart, and none is a number.
    """
    if len(cells) != len(header) or len(header) < LEAST_HEADINGS or is_number(cells[-1]) or is_number(cells[0]):
        return None
    known = {split_unit(name)[0].lower() for name in header}
    names = [split_unit(cell.strip())[0].lower() for cell in cells]
    if not all(name and not is_number(name) for name in names) or 2 * len(known & set(names)) <= len(header):
        return None
    return next((i for i, cell in enumerate(cells) if cell.strip() != header[i]), None)


def _columns(body: Body, at: dict[Column, int], rows: list[list[str]], lines: list[int]) -> _Columns:
    read = {
        c: _numbers_or_nan if body.incomplete else _read_now_and_then if c.channel in EVENTS else _numbers for c in at
    }
    return {
        column: (_labels if column.label else read[column])(body.path, column, [row[i] for row in rows], lines)
        for column, i in at.items()
    }


def _rows(body: Body) -> Iterator[tuple[int, list[str]]]:
    """Line number and cells of each row that is not blank."""
    if body.delimiter is None:
        yield from ((n, cells) for n, row in enumerate(body.text(), body.first) if (cells := row.split()))
        return
    reader = csv.reader(body.text(), delimiter=body.delimiter)
    line = body.first
    lines, closed = body.content.count(b"\n") + 1, body.content.count(b'"') % 2 == 0
    try:
        for cells in reader:
            after = body.first + reader.line_num
            several = after - line > 1
            at_the_end = reader.line_num >= lines - 1
            if several and ((at_the_end and not closed) or after - line > MOST_LINES or len(cells) != len(body.names)):
                raise csv.Error("a quotation mark is not closed")
            if len(cells) > 1 or (cells and cells[0].strip()):
                yield line, cells
            line = after
    except csv.Error as error:
        raise InputError(f"{body.path}: line {line}: {error}; wanted one row on each line") from None


def _numbers(path: Path, column: Column, cells: list[str], lines: list[int]) -> Floats:
    try:
        if any("_" in cell for cell in cells):
            raise ValueError
        return np.array([float(cell) for cell in cells])
    except ValueError:
        row = next(i for i, cell in enumerate(cells) if not is_number(cell))
    hint = "" if cells[row].strip() else ", or read.incomplete = 'leave out'"
    raise InputError(f"{path}: line {lines[row]}: {column} is {shown(cells[row])}; wanted a number{hint}")


def _numbers_or_nan(path: Path, column: Column, cells: list[str], lines: list[int]) -> Floats:
    return np.array([float(cell) if is_number(cell) else np.nan for cell in cells])


def _read_now_and_then(path: Path, column: Column, cells: list[str], lines: list[int]) -> Floats:
    """Numbers where there are any: an empty cell is NaN."""
    return _numbers(path, column, [cell if cell.strip() else "nan" for cell in cells], lines)


def _labels(path: Path, column: Column, cells: list[str], lines: list[int]) -> list[str]:
    for cell, line in zip(cells, lines, strict=True):
        if _UNDECODABLE in cell:
            raise InputError(f"{path}: line {line}: {column} is {shown(cell)}; wanted UTF-8 text")
    return [cell.strip() for cell in cells]


def _place(body: Body, row: int) -> str:
    """Line of the 0-based ``row``: blank lines are no rows."""
    line = next((line for i, (line, _) in enumerate(_rows(body)) if i == row), None)
    return f"row {row}" if line is None else f"line {line}"


def _word(body: Body, at: Mapping[str, int], channel: str, row: int) -> str:
    """Cell of a channel in the 0-based ``row``; "" where the row has none."""
    cells = next((cells for i, (_, cells) in enumerate(_rows(body)) if i == row), [])
    return cells[at[channel]].strip() if at[channel] < len(cells) else ""
