"""Data of R (``.rda``, ``.RData``), by the package rdata (the ``io`` extra).

A column is ``frame.column``, ``matrix[0]``, ``matrix.column`` where the matrix names its columns, or a vector's name.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.data.readers.arrays import table_of
from insenv.data.readers.table import Column, Table, check_size, decoding

_OPENERS: Mapping[bytes, Callable[..., Any]] = {b"\x1f\x8b": gzip.open, b"BZ": bz2.open, b"\xfd7": lzma.open}


def read_rda(path: Path, columns: Sequence[Column]) -> Table:
    """Wanted columns of the vectors, matrices and data frames of an R file.

    Raises
    ------
    InputError
        If rdata is not installed, the file is damaged or too large, or a column is missing, no number or no vector.
    """
    return table_of(path, columns, rda_arrays(path))


def rda_arrays(path: Path) -> dict[str, Any]:
    """All vectors, matrices and columns of data frames of an R file, by name.

    Raises
    ------
    InputError
        If rdata is not installed, or the file is damaged or too large.
    """
    try:
        import rdata
    except ImportError:
        raise InputError(f"{path}: R data need rdata; install insenv[io]") from None
    with decoding(path, "R data", quiet=True):
        _check_size(path)
        tree = rdata.read_rda(path)
        arrays: dict[str, Any] = {}
        for name, value in tree.items():
            arrays |= _flat(name, value)
    return arrays


def _check_size(path: Path) -> None:
    with path.open("rb") as file:
        opener = _OPENERS.get(file.read(2))
    if opener is None:
        return
    size = 0
    with opener(path, "rb") as file:
        while part := file.read(1 << 22):
            size += len(part)
            check_size(path, size, path.stat().st_size)


def _flat(name: str, value: Any) -> dict[str, Any]:
    """Columns of a data frame or a matrix with names, members of a list, or the value itself."""
    if isinstance(value, Mapping):
        found: dict[str, Any] = {}
        for key, one in value.items():
            found |= _flat(f"{name}.{key}", one)
        return found
    if hasattr(value, "columns"):
        return {f"{name}.{key}": np.asarray(value[key]) for key in value.columns}
    array = np.asarray(value)
    found = {name: array}
    labels = value.coords[value.dims[1]].values if hasattr(value, "dims") and array.ndim == 2 else ()
    if hasattr(value, "dims") and len(labels) and value.dims[1] in value.coords:
        found |= {f"{name}.{label}": array[:, i] for i, label in enumerate(labels)}
    return found
