"""Readers of data files: path -> wanted columns as float64, in the file's own units.

One module per family of formats. Nothing is repaired, and nothing skipped unless the manifest says so: what cannot be
read as it stands is an `InputError` that names the file and the line or row.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.data.manifest.schema import shown
from insenv.data.manifest.spec import EVENTS, Reading, RunSpec
from insenv.data.readers import arrays, bags, binary, novatel, parquet, psins, rdata, spreadsheet, text
from insenv.data.readers.table import Column, Table, rows_of

__all__ = ["MOST_INCOMPLETE", "Column", "Table", "check_table", "read_table"]

#: Share of rows that may be incomplete where those are left out.
MOST_INCOMPLETE = 0.2
_TEXTS: Mapping[str, Callable[[Path, Sequence[Column], Reading], Table]] = {
    "csv": text.read_csv,
    "text": text.read_text,
    "xlsx": spreadsheet.read_xlsx,
}
_READERS: Mapping[str, Callable[[Path, Sequence[Column]], Table]] = {
    "npz": arrays.read_npz,
    "mat": arrays.read_mat,
    "parquet": parquet.read_parquet,
    "psins-imu": psins.read_psins,
    "rda": rdata.read_rda,
    "novatel": novatel.read_novatel,
    "bag": bags.read_bag,
}


def read_table(run: RunSpec, columns: Sequence[Column], width: int | None = None) -> Table:
    """Wanted ``columns`` of a run's file; ``width`` is the number of values in a row of float64-le.

    Raises
    ------
    InputError
        If the file is missing or cannot be read, lacks a column or has it twice, has no rows, ragged rows,
        text in a number column, or NaN or infinite samples.
    """
    path = run.file
    if os.path.isdir(path):
        raise InputError(f"{path}: is a folder; wanted a data file")
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such data file")
    if run.reading.lines and run.format != "text":
        raise InputError(
            f"{path}: read.lines is of lines of text, and format is {run.format!r}; wanted format = 'text'"
        )
    try:
        if run.format == "float64-le":
            table = binary.read_float64(path, columns, width or 1)
        elif run.format in _TEXTS:
            table = _TEXTS[run.format](path, columns, run.reading)
        else:
            table = _READERS[run.format](path, columns)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    table = _chosen(path, table, columns, run.reading)
    check_table(path, columns, table)
    return table


def _chosen(path: Path, table: Table, columns: Sequence[Column], reading: Reading) -> Table:
    """The rows that are wanted of a table."""
    if not reading.skip and not reading.incomplete:
        return table
    check_lengths(path, columns, table)
    kept = np.arange(len(table)) >= reading.skip
    if not kept.any():
        raise InputError(f"{path}: read.skip = {reading.skip} leaves nothing of {len(table)} rows; wanted fewer")
    whole = np.ones(len(table), dtype=bool)
    for channel, values in table.values.items():
        whole &= np.isfinite(values) | np.bool_(not reading.incomplete or channel in EVENTS)
    lost = int(np.sum(kept & ~whole))
    if lost > MOST_INCOMPLETE * kept.sum():
        found = f"{lost} of {int(kept.sum())} rows lack a value"
        raise InputError(f"{path}: {found}; wanted at most {100 * MOST_INCOMPLETE:.0f} % of them incomplete")
    first = _first_lack(table, columns, int(np.argmax(kept & ~whole))) if lost else ""
    noun = f"1 row lacks a value, {first}" if lost == 1 else f"{lost} rows lack a value, the first {first}"
    rows = np.flatnonzero(kept & whole)
    taken = replace(rows_of(table, rows), index=rows - reading.skip)
    return replace(taken, notes=(*table.notes, *((f"{noun}: left out",) if lost else ())))


def _first_lack(table: Table, columns: Sequence[Column], row: int) -> str:
    """Where a row is that lacks a value, and the word that stands in its place."""
    for column in columns:
        values = table.values.get(column.channel)
        if values is not None and column.channel not in EVENTS and not np.isfinite(values[row]):
            word = table.word(column.channel, row)
            return f"{table.place(row)}{f' ({column.key} is {shown(word)})' if word else ''}"
    return table.place(row)


def check_table(path: Path, columns: Sequence[Column], table: Table) -> None:
    """Refuse columns that are of different lengths, empty or not finite."""
    check_lengths(path, columns, table)
    for column in columns:
        values = table.values.get(column.channel)
        if values is not None and column.channel not in EVENTS and not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values)))
            hint = "wanted a finite number, or read.incomplete = 'leave out'"
            raise InputError(f"{path}: {table.place(row)}: {column} is {values[row]}; {hint}")


def check_lengths(path: Path, columns: Sequence[Column], table: Table) -> None:
    """Refuse columns that are of different lengths or empty."""
    lengths = {c: len(table.labels[c.channel] if c.label else table.values[c.channel]) for c in columns}
    if not lengths or not max(lengths.values()):
        raise InputError(f"{path}: has no rows of data; wanted at least one")
    longest = max(lengths, key=lambda c: lengths[c])
    for column, length in lengths.items():
        if length != lengths[longest]:
            other = f"{lengths[longest]} in {longest}"
            raise InputError(f"{path}: {column} has {length} rows against {other}; wanted as many")
