"""Text tables: rows of values between commas, semicolons, tabs or blanks, with or without a header line.

The header is read here, the rows below it by `insenv.data.readers.rows`.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from pathlib import Path

from insenv.core.errors import InputError
from insenv.core.units import scale_to_si
from insenv.data.manifest.schema import shown
from insenv.data.manifest.spec import CHANNELS, INCREMENTS, WHOLE, Reading
from insenv.data.readers import labelled
from insenv.data.readers.commas import LOOKED_AT, ROW, delimiter_of, number_in, of_one_delimiter, with_decimal_points
from insenv.data.readers.rows import COMMENTS, Body, is_number, read_rows
from insenv.data.readers.table import Column, Table, find_column, split_unit, unit_of_cell

_LINE = re.compile(rb"([^\r\n]*)(\r\n|\r|\n|\Z)")
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
#: Bytes at the beginning of a file that are looked at first, and those of a line that there is no need for.
HEAD_BYTES, LONGEST = 8_000_000, 1_000_000
#: Lines at the head of a file among which the header is looked for by its names.
HEAD = 60
#: A line that begins with zero bytes: a logger lost power, a port was opened anew; the row behind may lack digits.
_NULLS = re.compile(rb"(?:\A|(?<=[\r\n]))\0+[^\r\n]*")
#: The minus sign of typesetters in UTF-8, before a number; a number whose exponent stands behind a D.
_MINUS, _MINUS_OF_NUMBER = b"\xe2\x88\x92", re.compile(rb"\xe2\x88\x92(?=[\d.])")
_FORTRAN = re.compile(rb"(?<![\w.])([+-]?(?:\d+\.?\d*|\.\d+))[dD]([+-]\d{2,3})(?![\w.])")
#: A row of an array as NumPy prints it.
_PRINTED = re.compile(rb"[ \t]*\[[-+.\deE\[ \t]+\][\] \t]*")
#: A line longer than this is none of units.
LONGEST_LINE = 10_000
#: Bytes below are none of text.
_LEAST_OF_TEXT = 9
_CHECKSUM = re.compile(rb"\*[0-9A-Fa-f]{2}[ \t]*$", re.M)


@dataclass(frozen=True)
class Line:
    """A line that is not blank: number from 1, its bytes ``[start, end)`` with the line break, its text."""

    path: Path
    number: int
    start: int
    end: int
    text: str

    def cells(self, delimiter: str | None) -> list[str]:
        """Values of the line; ``None`` parts at blanks."""
        if delimiter is None:
            return self.text.split()
        try:
            return next(csv.reader([self.text], delimiter=delimiter))
        except csv.Error as error:
            raise InputError(f"{self.path}: line {self.number}: {error}; wanted a row of values") from None

    def delimiter(self) -> str | None:
        """What parts its cells; ``None`` for blanks."""
        return delimiter_of(self.text)


def read_csv(path: Path, columns: Sequence[Column], reading: Reading = WHOLE) -> Table:
    """Wanted columns of a table with one header line; commas, semicolons or tabs between values.

    Raises
    ------
    InputError
        If the header, a row or a number is not what it should be.
    """
    head = _head(path)
    if path.stat().st_size > HEAD_BYTES:
        # Faults of the header and the first rows are told before all of a long file is in memory.
        csv_table(path, head[: max(head.rfind(b"\n"), head.rfind(b"\r")) + 1], columns, reading)
    return csv_table(path, text_of(path), columns, reading)


def text_of(path: Path, most: int = -1) -> bytes:
    """The first ``most`` bytes of a text file (all where negative), as UTF-8 where its byte order mark is of UTF-16.

    Spreadsheets and scripts of Windows save tables so ("Unicode text", ``>`` of PowerShell). A character that ``most``
    cuts in two is left out.

    Raises
    ------
    InputError
        If a file with such a mark is no UTF-16.
    """
    with path.open("rb") as file:
        content = file.read(most)
    if not content.startswith(_UTF_16):
        plain = _as_python_writes(_without_brackets(_in_utf_8(_NULLS.sub(b"", content))))
        return _as_wide_as_its_header(of_one_delimiter(plain))
    try:
        content = codecs.getincrementaldecoder("utf-16")().decode(content, final=most < 0).encode()
        return _as_wide_as_its_header(of_one_delimiter(_as_python_writes(content)))
    except UnicodeError:
        raise InputError(f"{path}: begins as UTF-16 text and is none; wanted UTF-8 or UTF-16 text") from None


def _in_utf_8(content: bytes) -> bytes:
    """Text of Windows (cp1252), as its head shows, in UTF-8: a degree sign of a spreadsheet changes no number."""
    lines = content[:LOOKED_AT].splitlines(keepends=True)
    spoken = b"".join(line for line in lines if line.endswith(b"\n") and not line.isascii())
    if not spoken or any(ROW.match(line) for line in spoken.splitlines()):
        return content
    try:
        spoken.decode()
    except UnicodeDecodeError:
        if min(spoken) >= _LEAST_OF_TEXT and b"\0" not in content:
            return content.decode("cp1252", "replace").encode()
    return content


def _as_python_writes(content: bytes) -> bytes:
    """Numbers with the minus sign of typesetters (U+2212), or Fortran's D before the exponent, as others write them."""
    if _MINUS in content:
        content = _MINUS_OF_NUMBER.sub(b"-", content)
    return _FORTRAN.sub(rb"\1E\2", content) if _FORTRAN.search(content[:LOOKED_AT]) else content


def _without_brackets(content: bytes) -> bytes:
    """Rows of an array as NumPy prints it (``[[0. 1.]``) without its brackets; other text as it is."""
    lines = [line for line in content[:LOOKED_AT].splitlines()[:-1] if line.strip()]
    if not content.lstrip().startswith(b"[") or not lines or not all(map(_PRINTED.fullmatch, lines)):
        return content
    return content.translate(bytes.maketrans(b"[]", b"  "))


def _as_wide_as_its_header(content: bytes) -> bytes:
    """Rows without the empty cells beyond the last heading: loggers name fewer columns than they part by commas."""
    lines = content[:LOOKED_AT].splitlines()
    header, *rows = [line for line in lines[: len(lines) - (len(content) > LOOKED_AT)] if line.strip()] or [b""]
    delimiter = max((b"\t", b";", b","), key=header.count)
    widths = {row.count(delimiter) for row in rows}
    beyond = min(widths, default=0) - header.count(delimiter)
    if len(widths) != 1 or len(rows) < 2 or beyond < 1 or b'"' in content[:LOOKED_AT]:
        return content
    empty = re.compile(rb"(?:%b *){%d}(?=[\r\n]|\Z)" % (re.escape(delimiter), beyond))
    if delimiter not in header or ROW.match(header) or not all(empty.search(row) for row in rows):
        return content
    start = content.index(header) + len(header)
    return content[:start] + empty.sub(b"", content[start:])


def is_wide(path: Path) -> bool:
    """Whether a file begins with the byte order mark of UTF-16."""
    with path.open("rb") as file:
        return file.read(2) in _UTF_16


def _head(path: Path) -> bytes:
    """The beginning of a file, which has lines.

    Raises
    ------
    InputError
        If its first line has no end.
    """
    head = text_of(path, HEAD_BYTES)
    if len(head) >= HEAD_BYTES // 2 and b"\n" not in head[:LONGEST] and b"\r" not in head[:LONGEST]:
        raise InputError(f"{path}: line 1 is longer than {LONGEST / 1e6:g} MB; wanted a table, a row on each line")
    return head


def csv_table(path: Path, content: bytes, columns: Sequence[Column], reading: Reading) -> Table:
    """Wanted columns of the ``content`` of such a table; ``path`` is what messages name.

    Raises
    ------
    InputError
        As `read_csv`.
    """
    body = below_header(path, content, columns, reading.skip_lines)
    return read_rows(replace(with_decimal_points(body), incomplete=reading.incomplete), columns)


def below_header(path: Path, content: bytes, columns: Sequence[Column], skip_lines: int = 0) -> Body:
    """The rows below the header line of ``content``, the first bytes of a file or all of them.

    Lines above the header are passed over where they lack a wanted name and a later one has all; so is a row of units
    below it, which count where the header has none.

    Raises
    ------
    InputError
        If the first line is no header, or lacks a column.
    """
    content = content.removeprefix(_BYTE_ORDER_MARK)
    header = _named(path, content, columns, skip_lines) or _header(path, _lines(path, content, skip_lines))
    delimiter = header.delimiter() or ","
    names = header.cells(delimiter)
    for column in columns:
        if is_number(found := names[find_column(path, names, column)]):
            hint = "wanted a header line, or format = 'text' for a file without one"
            raise InputError(f"{path}: line {header.number}: the heading of {column} is {found.strip()}; {hint}")
    names, end, number = _with_units(path, content, header, names, columns)
    return Body(path, content[end:], number + 1, delimiter, names)


def _named(path: Path, content: bytes, columns: Sequence[Column], skip_lines: int) -> Line | None:
    """The first line among those at the head that has all names, where some column is named and the first has not."""
    wanted = {column.key.strip() for column in columns if isinstance(column.key, str)}
    if not wanted:
        return None
    lines = _lines(path, content, skip_lines)
    for n, line in enumerate(islice(lines, HEAD)):
        bare = replace(line, text=line.text.lstrip().lstrip("".join(COMMENTS)))
        cells = [cell.strip() for cell in bare.cells(bare.delimiter() or ",")]
        if wanted <= {*cells, *(split_unit(cell)[0] for cell in cells)}:
            return bare if n else None
    return None


def _with_units(
    path: Path, content: bytes, header: Line, names: list[str], columns: Sequence[Column]
) -> tuple[list[str], int, int]:
    """Headings with the units of the row below them, if that is one of units; its end, and its number."""
    start = next(_lines(path, content[header.end :]), None)
    if start is None:
        return names, header.end, header.number
    cells = start.cells(header.delimiter() or ",") if len(start.text) < LONGEST_LINE else []
    at = [
        (c, unit_of_cell(cells[find_column(path, names, c)]))
        for c in columns
        if not c.label and len(cells) == len(names)
    ]
    if not at or any(not cell or is_number(cell) for _, cell in at) or not any(_is_unit(c, cell) for c, cell in at):
        return names, header.end, header.number
    shown = [
        f"{n} [{u}]" if (u := unit_of_cell(c)) and not split_unit(n)[1] else n
        for n, c in zip(names, cells, strict=True)
    ]
    return shown, header.end + start.end, header.number + start.number


def _is_unit(column: Column, text: str) -> bool:
    """Whether ``text`` is a unit that the column's channel may have."""
    dimension = CHANNELS.get(column.channel)  # None: a column that no channel has been given yet
    any_of = (d for d in CHANNELS.values() if d not in ("number", "label"))
    for one in any_of if dimension is None else (dimension, INCREMENTS.get(dimension, dimension)):
        try:
            scale_to_si(text, one, "unit")
        except InputError:
            continue
        return True
    return False


def _header(path: Path, lines: Iterator[Line]) -> Line:
    """The header line: the first that is no comment, or the comment before it where that line is of numbers."""
    before = None
    line = _next(path, lines)
    while line.text.lstrip().startswith(COMMENTS):
        before, line = line, next(lines, None) or line
        if line is before:
            break
    if before is None:
        return line
    bare = replace(before, text=before.text.lstrip().lstrip("".join(COMMENTS)))
    cells = line.cells(line.delimiter() or ",")
    if line is before or (any(map(is_number, cells)) and len(bare.cells(line.delimiter() or ",")) == len(cells)):
        return bare
    return line


def read_text(path: Path, columns: Sequence[Column], reading: Reading = WHOLE) -> Table:
    """Wanted columns of a table with blanks between values, or any delimiter that its first row has.

    Lines at its head that open with ``#``, ``%`` or ``//`` are comments, of which the last may be the header; a first
    line without any number is a header. Lines that name each of their values are rows too
    (`insenv.data.readers.labelled`).

    Raises
    ------
    InputError
        If a row or a number is not what it should be.
    """
    _head(path)
    content = text_of(path).removeprefix(_BYTE_ORDER_MARK)
    if reading.lines:
        content = lines_of(path, content, reading.lines)
    if (found := labelled_names(path, content, reading.skip_lines)) is not None:
        line, named = found
        rows, others = labelled.as_rows(decoded(path, content[line.start :]), named)
        table = read_rows(Body(path, rows.encode(), line.number, ",", named, reading.incomplete), columns)
        if not others:
            return table
        note = f"{others} line{'s' * (others > 1)} between the rows, of other kinds: passed over"
        return replace(table, notes=(*table.notes, note))
    comment = None
    lines = _lines(path, content, reading.skip_lines)
    header = _next(path, lines)
    while header.text.lstrip().startswith(COMMENTS):
        comment, header = header, _next(path, lines)
    first = header
    if not any(is_number(number_in(cell)) for cell in header.cells(header.delimiter())):
        first = _next(path, lines)
    elif comment is not None:
        header = _commented(comment, first)
    delimiter = first.delimiter()
    names = header.cells(header.delimiter())
    by_index = all(isinstance(column.key, int) for column in columns)
    if header is not first and header.delimiter() is not None:
        names, end, _ = _with_units(path, content, header, names, columns)
        if end > first.start:
            first = _next(path, lines)
    if header is first or by_index:
        names = [str(i) for i in range(len(first.cells(delimiter)))]  # the words of a header may be any
    body = Body(path, content[first.start :], first.number, delimiter, names, reading.incomplete)
    return read_rows(with_decimal_points(body), columns)


def lines_of(path: Path, content: bytes, word: str) -> bytes:
    """The content with the lines that begin with ``word`` alone, the others blank; without checksums of NMEA.

    Raises
    ------
    InputError
        If no line begins so.
    """
    own = re.compile(rb"\s*" + re.escape(word.encode()) + rb"(?=[\s,;:])")
    lines = [line if own.match(line) else b"" for line in content.splitlines()]
    if not any(lines):
        first = Counter(
            re.split(rb"[\s,;:]", line.strip(), maxsplit=1)[0] for line in content.splitlines() if line.strip()
        )
        have = ", ".join(shown(w.decode("utf-8", "replace")) for w, _ in first.most_common(5))
        raise InputError(f"{path}: no line begins with {word!r} (read.lines); lines begin with {have}")
    return _CHECKSUM.sub(b"", b"\n".join(lines) + b"\n")


def labelled_names(path: Path, content: bytes, skip_lines: int = 0) -> tuple[Line, tuple[str, ...]] | None:
    """The first line that names each of its values, and the names; None where the file is a plain table."""
    spoken = (line for line in _lines(path, content, skip_lines) if not line.text.lstrip().startswith(COMMENTS))
    for one, other in pairwise(islice(spoken, HEAD)):
        if max(len(one.text), len(other.text)) > LONGEST_LINE or is_number(one.cells(one.delimiter())[0]):
            return None
        if (names := labelled.names_of(one.text)) and names == labelled.names_of(other.text):
            return one, names
    return None


def _commented(comment: Line, first: Line) -> Line:
    """The header that a comment is, if it has as many names as the ``first`` row has values; else that row."""
    bare = replace(comment, text=comment.text.lstrip().lstrip("".join(COMMENTS)))
    return bare if len(bare.cells(bare.delimiter())) == len(first.cells(first.delimiter())) else first


def looks_like_numbers(head: bytes) -> bool:
    """Whether a file that begins with ``head`` is text whose first word is a number."""
    words = head.split()
    return bool(words) and head.isascii() and b"\0" not in head and is_number(words[0].decode())


def decoded(path: Path, content: bytes) -> str:
    """UTF-8 text with plain line breaks.

    Raises
    ------
    InputError
        If it is not UTF-8; names the line.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = len(re.findall(rb"\r\n|\r|\n", content[: error.start])) + 1
        found = content[error.start]
        raise InputError(f"{path}: line {line}: byte 0x{found:02x} is not UTF-8; wanted UTF-8 text") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _lines(path: Path, content: bytes, skip: int = 0) -> Iterator[Line]:
    """Lines that are not blank, after the first ``skip``, one after another, decoded as they are asked for."""
    for number, match in enumerate(_LINE.finditer(content), start=1):
        if number > skip and match[1].strip():
            if not match[1].isascii():
                decoded(path, content[: match.end(1)])  # a fault is named with its line in the file
            yield Line(path, number, match.start(), match.end(), match[1].decode())


def _next(path: Path, lines: Iterator[Line]) -> Line:
    line = next(lines, None)
    if line is None:
        raise InputError(f"{path}: has no rows of data; wanted at least one")
    return line
