"""Readers of data files: path -> wanted columns as float64, in the file's own units.

One module per family of formats. Nothing is repaired or skipped: what cannot be read as it stands is an
`InputError` that names the file and the line or row.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.core.manifest.spec import RunSpec
from insenv.core.readers import arrays, binary, parquet, psins, text
from insenv.core.readers.table import Column, Table

__all__ = ["Column", "Table", "check_table", "read_table"]

_READERS: Mapping[str, Callable[[Path, Sequence[Column]], Table]] = {
    "csv": text.read_csv,
    "text": text.read_text,
    "npz": arrays.read_npz,
    "mat": arrays.read_mat,
    "parquet": parquet.read_parquet,
    "psins-imu": psins.read_psins,
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
    try:
        if run.format == "float64-le":
            table = binary.read_float64(path, columns, width or 1)
        else:
            table = _READERS[run.format](path, columns)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    check_table(path, columns, table)
    return table


def check_table(path: Path, columns: Sequence[Column], table: Table) -> None:
    """Refuse columns that are of different lengths, empty or not finite."""
    lengths = {c: len(table.labels[c.channel] if c.label else table.values[c.channel]) for c in columns}
    if not lengths or not max(lengths.values()):
        raise InputError(f"{path}: has no rows of data; wanted at least one")
    longest = max(lengths, key=lambda c: lengths[c])
    for column, length in lengths.items():
        if length != lengths[longest]:
            other = f"{lengths[longest]} in {longest}"
            raise InputError(f"{path}: {column} has {length} rows against {other}; wanted as many")
    for column in columns:
        values = table.values.get(column.channel)
        if values is not None and not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values)))
            raise InputError(f"{path}: {table.place(row)}: {column} is {values[row]}; wanted a finite number")
