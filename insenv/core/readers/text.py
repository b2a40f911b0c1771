"""Text tables: rows of values between commas, semicolons, tabs or blanks, with or without a header line.

The header is read here, the rows below it by `insenv.core.readers.rows`.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from insenv.core.errors import InputError
from insenv.core.readers.rows import Body, is_number, read_rows
from insenv.core.readers.table import Column, Table, find_column

_LINE = re.compile(rb"([^\r\n]*)(\r\n|\r|\n|\Z)")
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_COMMENTS = ("#", "%")
_DECIMAL_COMMA = re.compile(rb'(?:^|[;\t])["]?[ +-]*\d+,\d+[ ]*["]?(?:$|[;\t])')


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
        """The most frequent of tab, semicolon and comma outside quotes; ``None`` where there is none."""
        bare = re.sub(r'"[^"]*"', "", self.text)
        most = max("\t;,", key=bare.count)
        return most if most in bare else None


def read_csv(path: Path, columns: Sequence[Column]) -> Table:
    """Wanted columns of a table with one header line; commas, semicolons or tabs between values.

    Raises
    ------
    InputError
        If the header, a row or a number is not what it should be.
    """
    return read_rows(_with_decimal_points(below_header(path, path.read_bytes(), columns)), columns)


def _with_decimal_points(body: Body) -> Body:
    """The rows with points for decimal commas: between semicolons or tabs, with no point in the first row."""
    first = body.content[:4096].lstrip().split(b"\n", 1)[0].split(b"\r", 1)[0]
    if body.delimiter not in (";", "\t") or b"." in first or not _DECIMAL_COMMA.search(first):
        return body
    return replace(body, content=body.content.replace(b",", b"."))


def below_header(path: Path, content: bytes, columns: Sequence[Column]) -> Body:
    """The rows below the header line of ``content``, the first bytes of a file or all of them.

    Raises
    ------
    InputError
        If the first line is no header, or lacks a column.
    """
    content = content.removeprefix(_BYTE_ORDER_MARK)
    header = _header(path, _lines(path, content))
    delimiter = header.delimiter() or ","
    names = header.cells(delimiter)
    for column in columns:
        if is_number(found := names[find_column(path, names, column)]):
            hint = "wanted a header line, or format = 'text' for a file without one"
            raise InputError(f"{path}: line {header.number}: the heading of {column} is {found.strip()}; {hint}")
    return Body(path, content[header.end :], header.number + 1, delimiter, names)


def _header(path: Path, lines: Iterator[Line]) -> Line:
    """The header line: the first that is no comment, or the comment before it where that line is of numbers."""
    before = None
    line = _next(path, lines)
    while line.text.lstrip().startswith(_COMMENTS):
        before, line = line, next(lines, None) or line
        if line is before:
            break
    if before is None:
        return line
    bare = replace(before, text=before.text.lstrip().lstrip("".join(_COMMENTS)))
    cells = line.cells(line.delimiter() or ",")
    if line is before or (any(map(is_number, cells)) and len(bare.cells(line.delimiter() or ",")) == len(cells)):
        return bare
    return line


def read_text(path: Path, columns: Sequence[Column]) -> Table:
    """Wanted columns of a table with blanks between values, or any delimiter that its first row has.

    Lines at its head that open with ``#`` or ``%`` are comments; a first line without any number is a header.

    Raises
    ------
    InputError
        If a row or a number is not what it should be.
    """
    content = path.read_bytes().removeprefix(_BYTE_ORDER_MARK)
    lines = (line for line in _lines(path, content) if not line.text.lstrip().startswith(_COMMENTS))
    header = first = _next(path, lines)
    if not any(map(is_number, header.cells(header.delimiter()))):
        first = _next(path, lines)
    delimiter = first.delimiter()
    names = header.cells(header.delimiter())
    if header is first or all(isinstance(column.key, int) for column in columns):
        names = [str(i) for i in range(len(first.cells(delimiter)))]  # the words of a header may be any
    return read_rows(Body(path, content[first.start :], first.number, delimiter, names), columns)


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


def _lines(path: Path, content: bytes) -> Iterator[Line]:
    """Lines that are not blank, one after another, decoded as they are asked for."""
    for number, match in enumerate(_LINE.finditer(content), start=1):
        if match[1].strip():
            if not match[1].isascii():
                decoded(path, content[: match.end(1)])  # a fault is named with its line in the file
            yield Line(path, number, match.start(), match.end(), match[1].decode())


def _next(path: Path, lines: Iterator[Line]) -> Line:
    line = next(lines, None)
    if line is None:
        raise InputError(f"{path}: has no rows of data; wanted at least one")
    return line
