"""Headerless rows of little-endian float64."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.data.readers.table import Column, Table, find_column

#: Nothing measures less than this and more than nothing: bytes in another order do.
_SMALLEST = 1e-100


def read_float64(path: Path, columns: Sequence[Column], width: int) -> Table:
    """Rows of ``width`` float64 values; columns are asked for by index.

    Raises
    ------
    InputError
        If the size is no multiple of a row, a column is asked for by name, or the bytes are in another order.
    """
    size = path.stat().st_size
    if size % (8 * width):
        raise InputError(f"{path}: {size} bytes are no whole number of rows; wanted {8 * width} bytes a row")
    for column in columns:
        if column.label or not isinstance(column.key, int):
            raise InputError(f"{path}: {column} is no number column; rows of float64 need indices from 0")
    rows = np.fromfile(path, dtype="<f8").reshape(-1, width)
    names = [str(i) for i in range(width)]
    values = {c.channel: rows[:, find_column(path, names, c)].astype(np.float64) for c in columns}
    for column in columns:
        check_order(path, column, values[column.channel])
    return Table(values)


def check_order(path: Path, column: Column, values: Floats, first: int = 0) -> None:
    """Refuse bytes in another order, which make numbers that nothing measures; ``first`` is the number of row 0."""
    tiny = (values != 0) & (np.abs(values) < _SMALLEST)
    if tiny.any():
        found = f"row {first + int(np.argmax(tiny))}: {column} is {values[tiny][0]:.3g}"
        raise InputError(f"{path}: {found}, which is no measurement; wanted float64 with the low byte first")
