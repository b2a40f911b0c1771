"""Files of named arrays: NumPy's ``.npz`` and MATLAB's ``.mat``.

A column is named as the file names it: ``t``, a field ``imu.t`` of a structure, column 0 of a matrix as
``imu.wb[0]``, or row 0 of one that is much wider than high. A 0-based index alone means the column of the file's only
matrix.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError, nearest
from insenv.data.readers import text
from insenv.data.readers.mat5 import load_mat5, unfolded
from insenv.data.readers.table import Column, Table, as_labels, as_numbers, check_size, decoding

_INDEXED = re.compile(r"(?P<name>.+)\[(?P<index>\d{1,9})\]")
_HDF5 = b"\x89HDF\r\n\x1a\n"
#: A matrix of few rows that is so many times as wide as high has a channel in each row.
MOST_CHANNELS, WIDE = 32, 10
#: A MATLAB 7.3 file is HDF5 behind a block of 512 bytes.
_HDF5_OFFSETS = (0, 512)


def read_npz(path: Path, columns: Sequence[Column]) -> Table:
    """Wanted columns of a NumPy archive; pickled objects are refused.

    Raises
    ------
    InputError
        If the file is damaged, or a column is missing, no number or no vector.
    """
    with decoding(path, "npz"), path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise InputError(f"{path}: holds a single array; wanted an npz archive of named arrays")
        names = {_array_name(path, c, archive.files) for c in columns}
        stored = [] if archive.zip is None else archive.zip.infolist()
        members = [m for m in stored if m.filename.removesuffix(".npy") in names]
        check_size(path, sum(m.file_size for m in members), path.stat().st_size)
        return table_of(path, columns, {name: archive[name] for name in archive.files if name in names})


def read_mat(path: Path, columns: Sequence[Column]) -> Table:
    """Wanted columns of a MATLAB file (versions 4 to 7.3), or of a text table that only bears its suffix.

    Raises
    ------
    InputError
        If the file is damaged, or needs h5py and has none, or a column is missing, no number or no vector.
    """
    return text.read_text(path, columns) if is_text(path) else table_of(path, columns, mat_arrays(path))


def is_text(path: Path) -> bool:
    """Whether a file is a table in text that only bears the suffix ``.mat``."""
    with path.open("rb") as file:
        return text.looks_like_numbers(file.read(1024))


def mat_arrays(path: Path) -> dict[str, Any]:
    """All variables of a MATLAB file (versions 4 to 7.3), those of structures as ``outer.inner``.

    Raises
    ------
    InputError
        If the file is damaged, or needs h5py and has none.
    """
    with path.open("rb") as file:
        head = file.read(1024)
    if any(head[offset:].startswith(_HDF5) for offset in _HDF5_OFFSETS):
        return _load_hdf5(path)
    with decoding(path, "a MATLAB file"):
        check_size(path, unfolded(path), path.stat().st_size)
        return _flatten(_load_mat(path, head))


def _load_mat(path: Path, head: bytes) -> dict[str, Any]:
    """Variables of a MATLAB file before 7.3; version 4 has a zero among its first bytes and no header."""
    if 0 not in head[:4]:
        return load_mat5(path.read_bytes())
    from scipy.io import loadmat  # here and not above: scipy.io costs a tenth of a second to import

    variables: dict[str, Any] = loadmat(path, simplify_cells=True)
    return variables


def table_of(path: Path, columns: Sequence[Column], arrays: Mapping[str, Any]) -> Table:
    """Wanted columns of named arrays.

    Raises
    ------
    InputError
        If a column is missing, no number or no vector.
    """
    picked = {c: _pick(path, c, arrays) for c in columns}
    values = {c.channel: as_numbers(path, c, a) for c, a in picked.items() if not c.label}
    return Table(values, {c.channel: as_labels(path, c, a) for c, a in picked.items() if c.label})


def _array_name(path: Path, column: Column, names: Sequence[str]) -> str:
    """Which array holds ``column``."""
    if isinstance(column.key, int):
        if len(names) != 1:
            raise InputError(f"{path}: {column} is an index, with {len(names)} arrays in the file; wanted a name")
        return names[0]
    if column.key in names:
        return column.key
    if (matrix := matrix_of(column.key)) in names:
        return matrix
    raise InputError(f"{path}: no {column}; {nearest(column.key, names)}")


def matrix_of(key: str) -> str:
    """Name of the matrix of which ``key`` is a column, as in ``name[0]``; without an index, ``key`` itself."""
    indexed = _INDEXED.fullmatch(key)
    return indexed["name"] if indexed else key


def _pick(path: Path, column: Column, arrays: Mapping[str, Any]) -> Any:
    """The array, or the column of a matrix, that ``column`` asks for."""
    if isinstance(column.key, int):
        matrices = {name: a for name, a in arrays.items() if np.ndim(a) == 2}
        array, index = matrices[_array_name(path, column, list(matrices))], column.key
    else:
        name = _array_name(path, column, list(arrays))
        array = arrays[name]
        if name == column.key:
            return array
        index = int(column.key[len(name) + 1 : -1])
    shape = np.shape(array)
    if len(shape) == 2 and shape[0] <= MOST_CHANNELS and shape[1] >= WIDE * shape[0]:
        array, shape = np.transpose(array), shape[::-1]  # a channel in each row
    if len(shape) != 2 or index >= shape[1]:
        raise InputError(f"{path}: no {column}; its array has shape {shape}")
    return array[:, index]


def _flatten(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested structures as ``outer.inner`` names; MATLAB's own entries left out."""
    flat: dict[str, Any] = {}
    for name, value in tree.items():
        if isinstance(value, Mapping):
            flat |= _flatten(value, f"{prefix}{name}.")
        elif not name.startswith("__"):
            flat[prefix + name] = value
    return flat


def _load_hdf5(path: Path) -> dict[str, Any]:
    """Numeric data sets of a MATLAB 7.3 file, which stores a matrix by columns: transposed back."""
    try:
        import h5py
    except ImportError:
        raise InputError(f"{path}: MATLAB 7.3 files need h5py; install insenv[io]") from None
    arrays: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("#"):
            check_size(path, item.size * item.dtype.itemsize, path.stat().st_size)
            arrays[name.replace("/", ".")] = np.asarray(item[()]).T

    with decoding(path, "a MATLAB 7.3 file"), h5py.File(path, "r") as file:
        file.visititems(visit)
    return arrays
