"""Sheets of Excel workbooks (``.xlsx``), by openpyxl (the ``io`` extra): the first sheet, as a table with a header."""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Sequence
from pathlib import Path

from insenv.core.errors import InputError
from insenv.data.manifest.spec import WHOLE, Reading
from insenv.data.readers.table import Column, Table, check_size, decoding
from insenv.data.readers.text import csv_table


def read_xlsx(path: Path, columns: Sequence[Column], reading: Reading = WHOLE) -> Table:
    """Wanted columns of the first sheet; a row of the sheet is a line in messages.

    Raises
    ------
    InputError
        If openpyxl is not installed, the file is damaged, or header, row or number is not what it should be.
    """
    return csv_table(path, as_text(path), columns, reading)


def as_text(path: Path) -> bytes:
    """The first sheet as a table in text, tabs between its cells.

    Raises
    ------
    InputError
        If openpyxl is not installed, or the file is damaged.
    """
    try:
        import openpyxl
    except ImportError:
        raise InputError(f"{path}: Excel workbooks need openpyxl; install insenv[io]") from None
    text = io.StringIO()
    with decoding(path, "an Excel workbook", quiet=True):
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
        check_size(path, size, path.stat().st_size)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        writer = csv.writer(text, delimiter="\t", lineterminator="\n")
        for row in book.worksheets[0].iter_rows(values_only=True):
            # A row without any cell is a blank line, as between the rows of a badly written table.
            writer.writerow(["" if c is None else _text(c) for c in row] if any(c is not None for c in row) else [])
        book.close()
    return text.getvalue().encode()


def _text(cell: object) -> str:
    """A cell as one line of text, numbers as they are."""
    return repr(cell) if isinstance(cell, float) else " ".join(str(cell).split())
