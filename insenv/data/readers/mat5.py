"""MATLAB 5 files: a header of 128 bytes, then elements ``type, size, data``; a matrix holds elements again.

    matrix = flags, dimensions, name, then by class
        numbers     real part [, imaginary part]
        characters  text
        cell        one matrix per entry
        structure   length of a field's name, names, one matrix per field

Why not ``scipy.io.loadmat``: it trusts the types and sizes that a file states, so that one damaged byte can
end the whole process. Here every slice lies within its buffer, and damage raises. Sparse matrices, objects
and functions hold no columns and are left out.
Source: MathWorks, MAT-File Format (version 5), sections on data elements and on array formats.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_COMPLEX = 0x0800
#: How numbers are stored, by element type, and what they stand for, by array class.
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_ENCODINGS = {1: "utf-8", 2: "utf-8", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_Element = tuple[int, bytes]


def load_mat5(content: bytes) -> dict[str, Any]:
    """Variables of a file: arrays, texts, object arrays (cells) and dicts (structures).

    Raises
    ------
    ValueError, LookupError, RecursionError, zlib.error
        If the file is damaged.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[_HEADER - 2 : _HEADER])
    if order is None:
        raise ValueError("no byte order in a header of 128 bytes")
    variables: dict[str, Any] = {}
    for kind, data in _elements(content[_HEADER:], order):
        if kind == _COMPRESSED:
            ((kind, data),) = _elements(zlib.decompress(data), order)
        if kind != _MATRIX:
            raise ValueError(f"element type {kind} where a variable should be")
        name, value = _matrix(data, order)
        variables[name] = value
    return {name: value for name, value in variables.items() if name and value is not None}


def unfolded(path: Path) -> int:
    """Bytes of all variables of a file once they are decompressed, counted without keeping them.

    Raises
    ------
    ValueError, zlib.error
        If the file is damaged.
    """
    content = path.read_bytes()
    order = {b"IM": "<", b"MI": ">"}.get(content[_HEADER - 2 : _HEADER])
    if order is None:
        return len(content)
    total = 0
    for kind, data in _elements(content[_HEADER:], order):
        total += len(data)
        if kind == _COMPRESSED:
            packed, part = zlib.decompressobj(), data
            while part and not packed.eof:
                total += len(packed.decompress(part, 1 << 22))
                part = packed.unconsumed_tail
    return total


def _elements(data: bytes, order: str) -> Iterator[_Element]:
    """Type and data of the elements that fill ``data``, each from a multiple of 8 bytes on."""
    at = 0
    while at < len(data):
        kind, size = np.frombuffer(data, f"{order}u4", 2, at).tolist()
        start, limit = at + 8, len(data)
        if kind >> 16:  # up to four bytes stand inside the tag itself
            kind, size, start, limit = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if start + size > limit:
            raise ValueError(f"an element of {size} bytes reaches beyond its end")
        yield kind, data[start : start + size]
        at = start + size if kind == _COMPRESSED else start + size + (-(start + size) % 8)


def _matrix(data: bytes, order: str) -> tuple[str, Any]:
    """Name and value of one matrix; None for a class that holds no columns."""
    if not data:
        return "", np.zeros((0, 0))
    parts = list(_elements(data, order))
    array_class = int(_integers(parts[0], order)[0]) & 0xFF
    if array_class not in _READERS:
        if not 0 < array_class < 20:
            raise ValueError(f"array class {array_class}")
        return "", None
    shape = tuple(_integers(parts[1], order).tolist())
    if len(shape) < 2 or min(shape) < 0:
        raise ValueError(f"dimensions {shape}")
    return parts[2][1].decode("utf-8"), _READERS[array_class](parts, shape, order)


def _integers(part: _Element, order: str) -> NDArray[Any]:
    kind, data = part
    if kind not in (5, 6):
        raise ValueError(f"element type {kind} where integers should be")
    return np.frombuffer(data, order + _STORED[kind])


def _numbers(parts: list[_Element], shape: tuple[int, ...], order: str) -> NDArray[Any]:
    """Array of a numeric class, from columns to rows."""
    flags = int(_integers(parts[0], order)[0])
    stored = [np.frombuffer(data, order + _STORED[kind]) for kind, data in parts[3:]]
    if len(stored) != (2 if flags & _COMPLEX else 1):
        raise ValueError(f"{len(stored)} parts of a number")
    values = stored[0] + 1j * stored[1] if flags & _COMPLEX else stored[0].astype(_CLASSES[flags & 0xFF])
    return values.reshape(shape, order="F")


def _characters(parts: list[_Element], shape: tuple[int, ...], order: str) -> Any:
    """Text of one row; an array of texts where there are several."""
    if not math.prod(shape):
        return ""
    ((kind, data),) = parts[3:]
    byte_order = "" if _ENCODINGS[kind] == "utf-8" else {"<": "-le", ">": "-be"}[order]
    text = data.decode(_ENCODINGS[kind] + byte_order)
    if len(text) != math.prod(shape):
        raise ValueError(f"{len(text)} characters for dimensions {shape}")
    rows = [text[i :: shape[0]] for i in range(shape[0])]
    return rows[0] if len(rows) == 1 else np.array([row.rstrip() for row in rows])


def _cell(parts: list[_Element], shape: tuple[int, ...], order: str) -> NDArray[Any]:
    """Object array of the entries."""
    if len(parts) - 3 != math.prod(shape):
        raise ValueError(f"{len(parts) - 3} entries for dimensions {shape}")
    cells = np.empty(len(parts) - 3, dtype=object)
    cells[:] = [_nested(part, order) for part in parts[3:]]
    return cells.reshape(shape, order="F")


def _structure(parts: list[_Element], shape: tuple[int, ...], order: str) -> Any:
    """Fields of a single structure by name; None for an array of structures."""
    if math.prod(shape) != 1:
        return None
    (length,) = _integers(parts[3], order).tolist()
    raw = parts[4][1]
    names = [raw[i : i + length].split(b"\0")[0].decode("utf-8") for i in range(0, len(raw), length)]
    return {name: _nested(part, order) for name, part in zip(names, parts[5:], strict=True)}


def _nested(part: _Element, order: str) -> Any:
    kind, data = part
    if kind != _MATRIX:
        raise ValueError(f"element type {kind} where a matrix should be")
    return _matrix(data, order)[1]


_READERS = {1: _cell, 2: _structure, 4: _characters} | dict.fromkeys(_CLASSES, _numbers)
