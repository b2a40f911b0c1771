"""What a comma in a table is: it parts cells, or stands for the decimal point, as in the tables of half of Europe.

Between semicolons, tabs or blanks, and within quotation marks, a comma with a digit on either side is that of a decimal
where no number has a point. Numbers whose thousands are parted are refused: ``1.020`` of such a table is a thousand and
twenty, and would be read as one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from insenv.core.errors import InputError
from insenv.data.manifest.schema import shown
from insenv.data.readers.rows import Body

#: Bytes at the beginning in which commas are looked at.
LOOKED_AT = 16384
_QUOTED = re.compile(r'"[^"]*"')
#: A cell with a decimal comma, of a number or of a time of day.
_DECIMAL = re.compile(r"(?:[^,.]*|[^,]*:\d)\d,\d+(?:[eE][+-]?\d+)?[ \t]*")
_SIGN = r"[ ]*[+-]?"
_WITH_COMMA = re.compile(rf"{_SIGN}\d*,\d+(?:[eE][+-]?\d+)?[ ]*")
_WITH_POINT = re.compile(rf"{_SIGN}\d*\.\d+(?:[eE][+-]?\d+)?[ ]*")
#: Thousands that are parted, with a decimal behind them by which they are told from one.
_THOUSANDS = re.compile(rf"{_SIGN}\d{{1,3}}(?:(?:\.\d{{3}})+,\d+|(?:,\d{{3}})+\.\d+)[ ]*")
#: Among numbers with a decimal comma one with a point.
_POINTED = re.compile(
    rb"(?:^|[;\t ])[ ]*\"?([+-]?(?:\d+\.\d+|\d{1,3}(?:\.\d{3})+(?:,\d+)?))\"?[ ]*(?=[;\t\r\n ]|\Z)", re.M
)
#: A number in quotation marks: with a decimal comma; with that or with parted thousands.
_QUOTED_DECIMAL = re.compile(rb'"([ ]*[+-]?\d*),(\d+(?:[eE][+-]?\d+)?[ ]*)"')
_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
#: The beginning of a row of numbers.
ROW = re.compile(rb"[ \t]*[+-]?[0-9.]")


def delimiter_of(text: str) -> str | None:
    """The most frequent of tab, semicolon, bar and comma outside quotes that may part the cells; None of none.

    Commas do not, where all stand in decimals between tabs or semicolons.
    """
    bare = _QUOTED.sub("", text)
    most = max("\t;|,", key=bare.count)
    if most == ",":
        if len(cells := bare.split()) > 1 and all(map(_WITH_COMMA.fullmatch, cells)):
            return None
        for other in ("\t", ";"):
            if other in bare and all(_is_decimal(cell) for cell in bare.split(other) if "," in cell):
                return other
    return most if most in bare else None


def _is_decimal(cell: str) -> bool:
    """Whether the comma of a cell may be that of a decimal, or of thousands."""
    return bool(_DECIMAL.fullmatch(cell) or _THOUSANDS.fullmatch(cell))


def number_in(cell: str) -> str:
    """A cell with a point for a decimal comma."""
    return cell.strip().replace(",", ".")


def of_one_delimiter(content: bytes) -> bytes:
    """Rows that commas and semicolons part (``t,x,y;z``), or that end in a semicolon as MATLAB's do, by commas alone.

    A comma between two digits may be that of a decimal, or of thousands: where all may, nothing is changed.
    """
    lines = content[:LOOKED_AT].splitlines()
    rows = [line for line in lines[: len(lines) - (len(content) > LOOKED_AT)] if ROW.match(line)]
    if len(rows) < 2 or not all(b"," in row and b";" in row and b'"' not in row for row in rows):
        return content
    texts = [row.decode("utf-8", "replace").strip() for row in rows]
    cells = [re.split("[,;]", row.rstrip(";")) for row in texts]
    if len({len(row) for row in cells}) > 1 or all(
        _is_decimal(cell) for row in texts for cell in row.split(";") if "," in cell
    ):
        return content
    return re.sub(rb";[ \t]*(?=[\r\n]|$)", b"", content).replace(b";", b",")


def check_thousands(path: Path, number: int, cells: Sequence[str]) -> None:
    """Refuse cells of a line of which the thousands are parted.

    Raises
    ------
    InputError
        If there is one.
    """
    for cell in cells:
        if _THOUSANDS.fullmatch(cell):
            raise _refused(path, number, cell)


def _refused(path: Path, number: int, cell: str) -> InputError:
    said = f"line {number}: {shown(cell.strip())} has a thousands separator, or a decimal sign unlike the rows above"
    return InputError(f"{path}: {said}; wanted numbers with a decimal point or comma and no other sign")


def with_decimal_points(body: Body) -> Body:
    """The rows with points for decimal commas, if the first has no point.

    Raises
    ------
    InputError
        If a later number has a point, or may be one of thousands.
    """
    head = body.content[:LOOKED_AT].decode("utf-8", "replace").splitlines()
    rows = head if len(body.content) <= LOOKED_AT else head[:-1]
    if body.delimiter == ",":
        return _within_quotes(body, rows)
    cells = [[cell.strip(' "') for cell in row.split(body.delimiter)] for row in rows]
    if not cells or any(map(_WITH_POINT.fullmatch, cells[0])):
        return body
    if not any(_WITH_COMMA.fullmatch(cell) for row in cells for cell in row):
        return body
    if (bad := _POINTED.search(body.content)) is not None:
        raise _refused(body.path, body.first + body.content.count(b"\n", 0, bad.start(1)), bad[1].decode())
    return replace(body, content=body.content.replace(b",", b"."))


def _within_quotes(body: Body, rows: Sequence[str]) -> Body:
    """The rows of a table between commas, of which decimals stand in quotation marks."""
    cells = [(n, cell) for n, row in enumerate(rows, body.first) for cell in _QUOTED.findall(row)]
    found = [(n, cell) for n, cell in cells if _WITH_COMMA.fullmatch(cell.strip('"'))]
    if not found:
        return body
    if all(_EITHER.fullmatch(cell.strip(' "')) for _, cell in found):
        raise _refused(body.path, found[0][0], found[0][1].strip('"'))
    return replace(body, content=_QUOTED_DECIMAL.sub(rb'"\1.\2"', body.content))
