"""All columns of a data file, as its reader would give them: headings, numbers, and how the file is to be read.

Of a text file the first lines tell the delimiter and the first row of numbers; what stands above it is the header line,
a row of units, comments, or settings of the logger such as ``Fs,100``. The numbers then come through the readers that
`insenv close-loop` uses, so that what is shown here is what is read there.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Mounting, Site
from insenv.data.guess.heading import DIMENSION, kind_of, unit_in
from insenv.data.manifest.checks import SUFFIXES
from insenv.data.manifest.schema import shown
from insenv.data.manifest.spec import WHOLE, Reading, RunSpec
from insenv.data.readers import MOST_INCOMPLETE, Column, arrays, bags, labelled, rdata, read_table, spreadsheet
from insenv.data.readers.commas import check_thousands, number_in
from insenv.data.readers.conventions import unit_of
from insenv.data.readers.novatel import NAMES
from insenv.data.readers.rows import COMMENTS, MOST_LINES, HeadingsError, is_number
from insenv.data.readers.stamps import second
from insenv.data.readers.table import decoding, unit_of_cell
from insenv.data.readers.text import Line, labelled_names, lines_of, text_of

#: Of a text file so much is looked at for its layout, and so many lines.
HEAD_BYTES, HEAD_LINES = 400_000, 400
#: Rows in a line that must look alike for the first of them to be one of data.
ALIKE = 3
#: A table is no wider.
MOST_COLUMNS = 1000
#: Lines of a header: names, units, remarks.
HEADER_LINES = 3
#: Rows that are looked at for what they hold; more are read where a long file is told apart by them.
MOST_ROWS = 400_000
#: Share of cells in a column that must be numbers.
NUMERIC = 0.9
#: Kinds of columns that are not left out without a word.
_MEASURED = DIMENSION.keys() - {"time"}
#: A word that may head a line of one kind.
_KIND = re.compile(r"[$#!]?[A-Za-z_][A-Za-z0-9_]*")
#: The beginning of a record of a NovAtel receiver.
_RECORD = re.compile(rb"[#%]([A-Z0-9]{4,}A),[^;\r\n]*;")
_FREQUENCY = re.compile(
    r"(fs|f_s|(sampling|sample|output|data|update)[ _]*(rate|frequency|freq))( *[\[(]? *hz *[\])]?)?", re.I
)
#: Key, heading and the word of a row of units, of each wanted column.
_Named = list[tuple[str | int, str, str | None]]


@dataclass(frozen=True)
class Listed:
    """One column: ``key`` for the manifest, heading ("" where there is none), the unit row's word, numbers.

    ``stamped``: they were dates or times of day, read in seconds.
    """

    key: str | int
    heading: str
    values: Floats
    row_unit: str | None = None
    known_unit: str | None = None
    stamped: bool = False


@dataclass(frozen=True)
class Listing:
    """A data file.

    Attributes
    ----------
    file : Path
    format : str
        As a manifest names it.
    columns : tuple of Listed
        Those that hold numbers, in the file's order.
    labels : tuple of str
        Headings of the columns that hold text.
    header : int
        Line of the header; 0 where there is none.
    rate : float or None
        Sampling rate that stands above the header [Hz].
    skip_lines : int
        Lines above the first row of a file without a header.
    incomplete : bool
        Whether some rows lack a value.
    lines : str
        The word with which the lines begin that are its rows, in a log of several kinds of lines.
    notes : tuple of str
        What else there is to say.
    """

    file: Path
    format: str
    columns: tuple[Listed, ...]
    labels: tuple[str, ...] = ()
    header: int = 0
    rate: float | None = None
    skip_lines: int = 0
    incomplete: bool = False
    lines: str = ""
    notes: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.columns[0].values) if self.columns else 0


@dataclass(frozen=True)
class _Lack:
    """What a column lacks: rows that hold a number, of those looked at, and where the first is that holds none."""

    have: int
    rows: int
    first: str

    def __str__(self) -> str:
        return f"{self.rows - self.have} of {self.rows} rows hold no number, {self.first}"


@dataclass(frozen=True)
class _Layout:
    """Layout of a text: delimiter, header cells, line of the header, line of the first row, which columns are what.

    ``filled``: columns of numbers that most rows have; in a table merged of two sources the slower one's are not.
    """

    delimiter: str | None
    names: tuple[str, ...]
    units: tuple[str, ...]
    header: int
    first: int
    numeric: tuple[int, ...]
    width: int
    rate: float | None = None
    texts: tuple[int, ...] = field(default=())
    filled: tuple[int, ...] = field(default=())
    lacking: Mapping[str, _Lack] = field(default_factory=dict)


def listing(path: Path, names: Sequence[str] = ()) -> Listing:
    """Columns of the file at ``path``; ``names`` are headings for one that has none.

    Raises
    ------
    InputError
        If there is no such file, its format is not known, or it holds no table of numbers.
    """
    if not path.is_file():
        raise InputError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}; wanted a data file")
    kind = SUFFIXES.get(path.suffix.lower(), "")
    if path.suffix.lower() == ".mcap":
        raise InputError(f"{path}: a ROS bag in MCAP; wanted it as .db3 (ros2 bag convert), or as a table")
    if kind == "psins-imu":
        return Listing(path, kind, ())
    if not path.stat().st_size:
        raise InputError(f"{path}: is empty; wanted a table of numbers")
    found = _archive(path, kind) if kind in ("npz", "mat", "rda", "parquet", "bag") else _text(path, kind)
    if not found.columns:
        raise InputError(f"{path}: no column of numbers was found; wanted a table, a row for each time")
    return _named(found, names)


def _named(found: Listing, names: Sequence[str]) -> Listing:
    """The listing with headings of the user's own."""
    if not names:
        return found
    if len(names) != len(found.columns):
        raise InputError(
            f"{found.file}: --columns names {len(names)} columns; wanted {len(found.columns)}, one for each"
        )
    return replace(
        found, columns=tuple(replace(c, heading=n.strip()) for c, n in zip(found.columns, names, strict=True))
    )


# ------------------------------------------------------------------------------------------------- archives


def _archive(path: Path, kind: str) -> Listing:
    """Columns of a file of named arrays."""
    if kind == "mat" and arrays.is_text(path):
        return _text(path, "text")
    if kind == "npz":
        with decoding(path, "npz"), np.load(path, allow_pickle=False) as archive:
            named: Mapping[str, Any] = {name: archive[name] for name in archive.files}
    elif kind == "parquet":
        named = _parquet(path)
    elif kind == "bag":
        named = bags.bag_arrays(path)
    else:
        named = arrays.mat_arrays(path) if kind == "mat" else rdata.rda_arrays(path)
    flat = [column for name, array in named.items() for column in _of_array(name, array)]
    if not flat:
        return Listing(path, kind, ())
    groups = Counter(len(c.values) for c in flat)  # most values, not most columns: parameters are many and short
    length = max(groups, key=lambda n: (_of_instruments(flat, n), n * groups[n]))
    left = sorted({arrays.matrix_of(str(c.key)) for c in flat if len(c.values) != length})
    if kind == "bag":
        flat, left = [replace(c, known_unit=bags.unit_of(str(c.key))) for c in flat], _topics(left)
    notes = (f"arrays of another length are not looked at: {', '.join(left)}",) if left else ()
    return _without_gaps(Listing(path, kind, tuple(c for c in flat if len(c.values) == length), notes=notes))


def _topics(keys: Sequence[str]) -> list[str]:
    """Topics of a bag's columns."""
    return sorted({key.partition(".")[0] for key in keys})


def _without_gaps(found: Listing) -> Listing:
    """The listing without rows that lack a value, columns that mostly do left out before."""
    numbers = {str(c.key): np.isfinite(c.values) for c in found.columns}
    columns = [c for c in found.columns if numbers[str(c.key)].mean() >= 1 - MOST_INCOMPLETE]
    lacking = {name: _lack(has) for name, has in numbers.items() if not has.all()}
    found = _named_as_left_out(replace(found, columns=tuple(columns)), lacking)
    whole = np.all([np.isfinite(c.values) for c in columns], axis=0) if columns else np.ones(0, dtype=bool)
    if whole.all() or whole.mean() < 1 - MOST_INCOMPLETE:
        return found
    lost = int(np.sum(~whole))
    note = f"{lost} row{'s lack' if lost > 1 else ' lacks'} a value: left out"
    kept = tuple(replace(c, values=c.values[whole]) for c in columns)
    return replace(found, columns=kept, incomplete=True, notes=(*found.notes, note))


def _lack(has: NDArray[np.bool_]) -> _Lack:
    """Of a column that has numbers in these rows."""
    return _Lack(int(has.sum()), len(has), f"the first of them row {int(np.argmin(has))}")


def _named_as_left_out(found: Listing, lacking: Mapping[str, _Lack]) -> Listing:
    """The listing with a note on each column of an instrument that is left out as it lacks too much.

    Raises
    ------
    InputError
        If no gyro and no accelerometer is left of those that the headings speak of.
    """
    have = {c.heading or str(c.key) for c in found.columns}
    missed = {name: lack for name, lack in lacking.items() if name not in have | {str(c.key) for c in found.columns}}
    left = {name: lack for name, lack in missed.items() if kind_of(arrays.matrix_of(name)) in _MEASURED}
    if not left:
        return found
    kinds = {kind_of(arrays.matrix_of(name)) for name in left}
    if kinds & {"gyro", "accel"} and {kind_of(arrays.matrix_of(name)) for name in have} <= {"time", "temperature"}:
        said = "; ".join(f"{name}: {lack}" for name, lack in list(left.items())[:2])
        more = f", and {len(left) - 2} more such columns" if len(left) > 2 else ""
        raise InputError(
            f"{found.file}: no gyro and no accelerometer has a number in most rows ({said}{more}); wanted a file for "
            "each sensor, with the rows that it has"
        )
    return replace(found, notes=(*found.notes, *(f"{name} is left out: {lack}" for name, lack in left.items())))


def _of_instruments(columns: Sequence[Listed], length: int) -> bool:
    """Whether columns of this length are a gyro's or an accelerometer's by their names."""
    names = {arrays.matrix_of(str(c.key)) for c in columns if len(c.values) == length}
    return any(kind_of(name) in ("gyro", "accel") or "imu" in name.lower() for name in names)


def _parquet(path: Path) -> dict[str, Any]:
    try:
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: Parquet needs pyarrow; install insenv[io]") from None
    with decoding(path, "Parquet"):
        table = parquet.read_table(path)
        return {name: table.column(name).to_numpy() for name in table.column_names}


def _of_array(name: str, array: Any) -> list[Listed]:
    """Columns of an array; those of a matrix of three are x, y and z, of another width have no heading."""
    array = np.asarray(array)
    if array.dtype.kind not in "iuf" or array.ndim not in (1, 2) or array.size < 2:
        return []
    if array.ndim == 1 or 1 in array.shape:
        return [Listed(name, name, np.ravel(array).astype(float))]
    if array.shape[0] <= arrays.MOST_CHANNELS and array.shape[1] >= arrays.WIDE * array.shape[0]:
        array = array.T
    if array.shape[1] > arrays.MOST_CHANNELS:
        return []
    headed = array.shape[1] == 3
    return [
        Listed(f"{name}[{i}]", f"{name}[{i}]" if headed else "", array[:, i].astype(float))
        for i in range(array.shape[1])
    ]


# ---------------------------------------------------------------------------------------------------- texts


def _text(path: Path, kind: str) -> Listing:
    """Columns of a text table, a workbook or the text log of a receiver."""
    content = spreadsheet.as_text(path)[:HEAD_BYTES] if kind == "xlsx" else text_of(path, HEAD_BYTES)
    if b"RAWIMU" in content:
        return _read(path, "novatel", [(name, name, None) for name in NAMES])
    _check_text(path, content)
    if kind != "xlsx" and (found := labelled_names(path, content[: content.rfind(b"\n") + 1])) is not None:
        line, names = found
        return _labelled(path, content[line.start :].decode("utf-8", "replace"), [(n, n, None) for n in names])
    reading, every = WHOLE, content
    word, others = _instrument_lines(path, content) if kind != "xlsx" else ("", ())
    if word:
        kind, reading, content = "text", replace(WHOLE, lines=word), lines_of(path, content, word)
    layout = _layout(path, content.decode("utf-8-sig", "replace"))
    if word and not layout.names and (names := _format_names(every, word, layout.width)):
        layout = replace(layout, names=names, units=("",) * layout.width)
    named: _Named = (
        [(layout.names[i], layout.names[i], layout.units[i]) for i in layout.numeric] if layout.names else []
    )
    if kind == "xlsx" or (kind == "csv" and layout.delimiter is None and not named):
        kind = kind if kind == "xlsx" else "text"
    elif kind not in ("csv", "text"):
        kind = "csv" if named and layout.delimiter else "text"
    texts = tuple(layout.names[i] for i in layout.texts) if layout.names else ()
    if named and layout.delimiter is None and kind == "csv":
        kind = "text"
    whole = replace(
        _first_that_reads(path, kind, layout, named, reading),
        header=layout.header,
        rate=layout.rate,
        labels=texts,
    )
    whole = _named_as_left_out(whole, {} if word else layout.lacking)  # else lines are not those of the file
    if others:
        note = f"lines that begin with {', '.join(others)} are not read: they want a manifest of their own"
        whole = replace(whole, notes=(*whole.notes, note))
    index = {c.key: i for i, c in enumerate(whole.columns)}
    headings = [str(c.heading) for c in whole.columns]
    return replace(whole, columns=tuple(replace(c, known_unit=_known(headings, index[c.key])) for c in whole.columns))


def _check_text(path: Path, content: bytes) -> None:
    """Refuse what is no table of text.

    Raises
    ------
    InputError
        If it is a pointer to a file, a receiver's log of other records, or no text.
    """
    if content.startswith(b"version https://git-lfs"):
        raise InputError(f"{path}: stands for a file of Git LFS that was not fetched; wanted the data (git lfs pull)")
    if record := _RECORD.match(content):
        name = record[1].decode()
        raise InputError(f"{path}: its records are {name}; of a receiver's logs wanted RAWIMU or RAWIMUS, or a table")
    if b"\0" in content:
        known = f"one of {', '.join(SUFFIXES)}"
        raise InputError(f"{path}: is no text; wanted {known}, or a manifest by hand with format = 'float64-le'")


def _labelled(path: Path, head: str, named: _Named) -> Listing:
    """The file of lines that name their values; a value that many lack, then lines that lack one are left out."""
    try:
        return _read(path, "text", named)
    except InputError:
        text, _ = labelled.as_rows(head, [name for _, name, _ in named])
        rows = [row.split(",") for row in text.splitlines() if row]
        kept = [one for i, one in enumerate(named) if _is_filled([row[i] for row in rows])]
        return _read(path, "text", kept, replace(WHOLE, incomplete=True))


def _known(headings: list[str], i: int) -> str | None:
    """The unit that a heading is known by among the others, as of Kalibr and PX4."""
    found = unit_of(headings, i)
    return found if found and f"[{found}]" not in headings[i] and f"({found})" not in headings[i] else None


def _instrument_lines(path: Path, content: bytes) -> tuple[str, tuple[str, ...]]:
    """The word with which the lines of an instrument begin, and those of other kinds beside it; "" in a table.

    Raises
    ------
    InputError
        If there are several kinds of lines in turn, none of a gyro or an accelerometer.
    """
    lines = content[: content.rfind(b"\n") + 1].decode("utf-8-sig", "replace").splitlines()[:HEAD_LINES]
    words = [re.split(r"[\s,;:]", line.strip(), maxsplit=1)[0] for line in lines if line.strip()]
    kinds = Counter(word for word in words if _KIND.fullmatch(word))
    often = [word for word, count in kinds.most_common() if count >= ALIKE]
    if not often or sum(kinds[w] for w in often) < NUMERIC * len(words):
        return "", ()
    if len(often) == 1:
        return (often[0] if often[0].startswith("$") else ""), ()
    if sum(a != b for a, b in pairwise(words)) < 2 * len(often):
        return "", ()  # labels of parts
    of_instruments = [w for w in often if kind_of(w) in ("gyro", "accel") or "imu" in w.lower()]
    if of_instruments:
        best = max(of_instruments, key=_rank)
        return best, tuple(w for w in often if w != best)
    if all(word.startswith("$") for word in often):
        found = f"its lines are of several kinds, {', '.join(often[:5])}, none of which says gyro or accelerometer"
        raise InputError(f"{path}: {found}; wanted lines of one, or [read] lines = '...' in a manifest by hand")
    return "", ()


def _format_names(content: bytes, word: str, width: int) -> tuple[str, ...]:
    """Names of the values of a line that its log states, as ArduPilot's ``FMT, 133, 40, IMU, Qff, TimeUS,GyrX``."""
    said = re.search(rf"^FMT, *\d+, *\d+, *{re.escape(word)}, *[^,]*,(.*)$", content.decode("utf-8", "replace"), re.M)
    names = (word, *(name.strip() for name in said[1].split(","))) if said else ()
    return names if len(names) == width else ()


def _rank(word: str) -> int:
    """Lines of a whole unit first, then those of gyros."""
    return 2 if "imu" in word.lower() else int(kind_of(word) == "gyro")


def _first_that_reads(path: Path, kind: str, layout: _Layout, named: _Named, reading: Reading) -> Listing:
    """The file by its names; by its indices, where the header does not fit its rows; without incomplete rows."""
    bare: _Named = [(i, layout.names[i], layout.units[i]) if layout.names else (i, "", None) for i in layout.numeric]
    tries = [(kind, named, 0)] if named and len({n for n, _, _ in named}) == len(named) else []
    if tries and layout.header > 1:  # lines above a header that no reader passes over
        tries.append((kind, named, layout.header - 1))
    if kind != "xlsx":
        above = (layout.header or 1) if layout.names or reading.lines else layout.first
        tries.append(("text", bare, above - 1))
    if not tries:
        raise InputError(f"{path}: {_unheaded(layout)}; wanted a header, a name of its own for each column")
    error: InputError | None = None
    sparse = len(layout.filled) < len(layout.numeric)
    for incomplete, whole in ((False, True), (True, True), (True, False))[: 3 if sparse else 2]:
        for one, wanted, skip in tries:
            kept = [w for w, i in zip(wanted, layout.numeric, strict=True) if whole or i in layout.filled]
            try:
                return _read(path, one, kept, replace(reading, skip_lines=skip, incomplete=incomplete))
            except HeadingsError:
                raise
            except InputError as fault:
                error = error or fault
    assert error is not None
    raise error


def _unheaded(layout: _Layout) -> str:
    """What is wrong with the headings of a sheet, whose columns are found by them alone."""
    names = [layout.names[i] for i in layout.numeric] if layout.names else []
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    return "no header above its rows of numbers" if twice is None else f"more than one column is headed {twice!r}"


def _read(path: Path, kind: str, wanted: _Named, reading: Reading = WHOLE) -> Listing:
    """The wanted columns through the reader of the format."""
    run = RunSpec(path, kind, path.name, Mounting(), Site(), reading)
    columns = [Column(str(i), key) for i, (key, _, _) in enumerate(wanted)]
    table = read_table(run, columns)
    return Listing(
        path,
        kind,
        tuple(
            Listed(key, text, table.values[str(i)], unit, stamped=str(i) in table.stamped)
            for i, (key, text, unit) in enumerate(wanted)
        ),
        skip_lines=reading.skip_lines,
        incomplete=reading.incomplete,
        lines=reading.lines,
        notes=(*table.notes, *table.behind),
    )


def _layout(path: Path, text: str) -> _Layout:
    """Where the rows of numbers begin, and what stands above them.

    Raises
    ------
    InputError
        If no rows of numbers are found.
    """
    lines = [Line(path, n, 0, 0, t) for n, t in _whole(text.splitlines()[:HEAD_LINES]) if t.strip()]
    split = [(line, line.delimiter(), _cells(line)) for line in lines]
    for line, _, cells in split:
        check_thousands(path, line.number, cells)
    shapes = Counter((d, len(c)) for _, d, c in split if _is_row(c, d))
    if not shapes:
        raise InputError(f"{path}: no rows of numbers among its first {len(lines)} lines; wanted a table of them")
    shape = max(shapes, key=lambda s: (shapes[s], s[1]))
    at = [i for i, (_, d, c) in enumerate(split) if (d, len(c)) == shape and _is_row(c, d)]
    few = min(ALIKE, len(at))
    first = next((a for a, b in zip(at, at[few - 1 :], strict=False) if b - a < few + 1), None)
    if first is None:
        raise InputError(
            f"{path}: its rows are not alike, two kinds of them in turn; wanted a table, a time in each row"
        )
    delimiter, width = shape
    if width > MOST_COLUMNS:
        raise InputError(f"{path}: has {width} columns; wanted at most {MOST_COLUMNS}, a row for each time")
    rows = [c for _, d, c in split[first:] if len(c) == width]
    numeric = tuple(i for i in range(width) if _numeric([row[i] for row in rows], delimiter))
    header, units = _header(split[:first], delimiter, width)
    names: tuple[str, ...] = ()
    if header is not None:
        names = tuple(cell.strip() for cell in _headings(split[header][0], delimiter, width))[:width]
    top = header if header is not None else first
    texts = tuple(i for i in range(width) if i not in numeric and any(row[i].strip() for row in rows))
    top_line = 0 if header is None else split[header][0].number
    filled = tuple(i for i in numeric if _is_filled([row[i] for row in rows]))
    number, rate = split[first][0].number, _rate(split[:top])
    lacking = _lacking([(one.number, c) for one, _, c in split[first:] if len(c) == width], names, delimiter)
    return _Layout(delimiter, names, units, top_line, number, numeric, width, rate, texts, filled, lacking)


def _lacking(rows: Sequence[tuple[int, list[str]]], names: Sequence[str], delimiter: str | None) -> dict[str, _Lack]:
    """What the named columns lack in the rows that are looked at, with the first line and the word in it."""
    found = {}
    for i, name in enumerate(names):
        cells = [(number, number_in(row[i])) for number, row in rows]
        bad = [(number, cell) for number, cell in cells if not is_number(cell) or np.isnan(float(cell))]
        if bad:
            number, cell = bad[0]
            said = f"the first of them line {number}, {f'which has {shown(cell)}' if cell else 'empty there'}"
            found[name] = _Lack(len(cells) - len(bad), len(cells), said)
    return found


#: A quotation mark that opens a cell; one behind digits is that of inches or seconds of arc.
_OPENED = re.compile(r'(?:^|[,;|\t])\s*"')


def _whole(lines: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines; one in which a cell in quotation marks goes on has the next ones behind it."""
    number = 0
    while number < len(lines):
        first, text = number + 1, lines[number]
        while _OPENED.search(text) and text.count('"') % 2 and number - first < MOST_LINES and number + 1 < len(lines):
            number += 1
            text += " " + lines[number]
        yield first, text
        number += 1


def _cells(line: Line) -> list[str]:
    """Cells of a line by its own delimiter."""
    return _parted(line, line.delimiter())


def _parted(line: Line, delimiter: str | None) -> list[str]:
    """Cells of a line, of a comment too; a line that cannot be parted is one."""
    try:
        return replace(line, text=line.text.lstrip(" ").lstrip("".join(COMMENTS))).cells(delimiter)
    except InputError:
        return [line.text]


def _is_row(cells: Sequence[str], delimiter: str | None) -> bool:
    """Whether half of the cells that are not empty are numbers."""
    full = [number_in(c) for c in cells if c.strip()]
    return bool(full) and 2 * sum(map(is_number, full)) >= len(full)


def _numeric(cells: Sequence[str], delimiter: str | None) -> bool:
    """Whether most cells are numbers, or stamps."""
    full = [c for c in cells if c.strip()]
    numbers = sum(is_number(number_in(c)) or second(c) >= 0 for c in full)
    return bool(full) and numbers >= NUMERIC * len(full)


def _is_filled(cells: Sequence[str]) -> bool:
    """Whether so many rows have a value, which "NaN" is none, that the others may be left out."""
    have = sum(bool(c.strip()) and not (is_number(c) and np.isnan(float(c))) for c in cells)
    return have >= (1 - MOST_INCOMPLETE) * len(cells)


def _header(
    above: Sequence[tuple[Line, str | None, list[str]]], delimiter: str | None, width: int
) -> tuple[int | None, tuple[str, ...]]:
    """Index of the header among the lines above the rows, and the words of a row of units below it."""
    fits = [
        i
        for i, (line, _, cells) in enumerate(above)
        if _fits(line, delimiter, width) and not any(is_number(c) for c in cells if c.strip())
    ]
    none = ("",) * width
    if not fits or fits[-1] != len(above) - 1:
        return None, none
    for top, below in reversed(list(pairwise(fits[-HEADER_LINES:]))):
        units = tuple(map(unit_of_cell, above[below][2]))
        any_unit = any(unit_in(cell, kind) for cell in units for kind in DIMENSION)
        if any_unit and top == below - 1 and len(units) == width and len(above[top][2]) >= width:
            return top, units
    return fits[-1], none


def _headings(line: Line, delimiter: str | None, width: int) -> list[str]:
    """Cells of a header; between blanks a heading may have one blank within it."""
    cells = _parted(line, delimiter)
    apart = re.split(r"[ \t]{2,}", line.text.strip().lstrip("".join(COMMENTS)).strip())
    return apart if delimiter is None and len(cells) not in (width, width + 1) and len(apart) == width else cells


def _fits(line: Line, delimiter: str | None, width: int) -> bool:
    """Whether a line parts into as many cells as a row, or one more (a date behind the last heading)."""
    cells = _headings(line, delimiter, width)
    return len(cells) in (width, width + 1) and (width > 1 or len(cells) == width)


def _rate(above: Sequence[tuple[Line, str | None, list[str]]]) -> float | None:
    """The sampling rate that a line above the header states [Hz]."""
    for line, _, _ in above:
        said = line.text.lstrip("".join(COMMENTS) + " ")
        parts = [part.strip() for part in re.split(r"[,;:=\t]", said) if part.strip()]
        if len(parts) < 2 or not _FREQUENCY.fullmatch(parts[0]):
            continue
        number = re.fullmatch(r"([0-9.eE+-]+) *(hz)?", parts[1], re.I)
        if number and is_number(number[1]) and float(number[1]) > 0:
            return float(number[1])
    return None
