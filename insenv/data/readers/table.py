"""What a reader returns: the wanted columns of one file as numbers, in the file's own units."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError, nearest
from insenv.core.recording import Floats, Site
from insenv.data.manifest.schema import shown
from insenv.data.manifest.spec import Quantity

#: A file may unfold to so many bytes however small it is, and to more if it is no smaller than this share of them.
MOST_BYTES, MOST_FOLDED = 500_000_000, 200
_WITH_UNIT = re.compile(r"(?P<name>[^(\[]*?)\s*[(\[](?P<unit>.+)[)\]]\s*")


@dataclass(frozen=True)
class Column:
    """A wanted column: for which channel, its name or 0-based index, and whether it holds labels."""

    channel: str
    key: str | int
    label: bool = False

    def __str__(self) -> str:
        return f"column {self.key!r} (channels.{self.channel})"


@dataclass(frozen=True)
class Table:
    """Wanted columns of one file.

    Attributes
    ----------
    values : mapping of channel to ndarray, shape (n,)
        Numbers in the file's units.
    labels : mapping of channel to sequence of n str
    units : mapping of channel to str
        Units that the file itself states.
    place : callable
        0-based row -> where an editor or a program shows it ("line 7", "row 6").
    word : callable
        Channel and 0-based row -> what stands there in a text; "" where nothing does.
    quantity : "rate" or "increment"
        What gyros and accelerometers hold unless the manifest says otherwise.
    t : ndarray, shape (n,), optional
        Time of the rows [s] where the format fixes it.
    site : Site, optional
        Where the file says it was recorded.
    notes : tuple of str
        What was not read, in words.
    behind : tuple of str
        What was not read behind the last row, in words: all rows keep their numbers.
    stamped : frozenset of str
        Channels that were dates or times of day, in seconds.
    index : ndarray of int, shape (n,), optional
        Number of each row in the file, where some were left out: rows without a time of their own keep their places.
    """

    values: Mapping[str, Floats]
    labels: Mapping[str, Sequence[str]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    place: Callable[[int], str] = "row {}".format
    word: Callable[[str, int], str] = "".format
    quantity: Quantity = "rate"
    t: Floats | None = None
    site: Site | None = None
    notes: tuple[str, ...] = ()
    behind: tuple[str, ...] = ()
    stamped: frozenset[str] = frozenset()
    index: NDArray[np.int64] | None = None

    def __len__(self) -> int:
        return max(map(len, (*self.values.values(), *self.labels.values())), default=0)


def rows_of(table: Table, kept: NDArray[np.int64]) -> Table:
    """Some rows of a table; each keeps its place in the file."""
    place, word = table.place, table.word
    return replace(
        table,
        values={name: values[kept] for name, values in table.values.items()},
        labels={name: [labels[i] for i in kept.tolist()] for name, labels in table.labels.items()},
        t=None if table.t is None else table.t[kept],
        index=None if table.index is None else table.index[kept],
        place=lambda i: place(int(kept[i])),
        word=lambda channel, i: word(channel, int(kept[i])),
    )


def find_column(path: Path, names: Sequence[str], column: Column) -> int:
    """Index of ``column`` among a file's column ``names``; a unit in brackets is not part of a name.

    Raises
    ------
    InputError
        If there is no such column, or two of that name.
    """
    if isinstance(column.key, int):
        if column.key >= len(names):
            raise InputError(f"{path}: no {column}; wanted an index below {len(names)}, the number of columns")
        return column.key
    bare = [split_unit(name)[0] for name in names]
    found = [i for i, name in enumerate(names) if name.strip() == column.key.strip()]
    found = found or [i for i, name in enumerate(bare) if name == column.key.strip()]
    # As it stands in the file, behind the mark of a comment.
    plain = column.key.lstrip("#%/ ").rstrip()
    found = found or [i for i, name in enumerate(names) if plain in (name.strip(), bare[i])]
    if not found:
        raise InputError(f"{path}: no {column}; {nearest(column.key, bare)}")
    if len(found) > 1:
        raise InputError(f"{path}: {column} is there {len(found)} times; wanted one column of that name")
    return found[0]


def split_unit(name: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as ``gyro_x (deg/s)`` or ``t [s]``."""
    match = _WITH_UNIT.fullmatch(name)
    return (match["name"].strip(), match["unit"].strip()) if match else (name.strip(), None)


def unit_of_cell(cell: str) -> str:
    """What a cell of a row of units says: ``[deg/s]`` and ``deg/s`` alike."""
    match = re.fullmatch(r"[(\[](.*)[)\]]", cell.strip())
    return (match[1] if match else cell).strip()


def as_numbers(path: Path, column: Column, values: Any) -> Floats:
    """One column as float64, shape (n,), with one dimension and a real number type.

    Raises
    ------
    InputError
        If ``values`` are of another kind or shape.
    """
    values = np.asarray(values)
    if values.dtype.kind not in "iuf":
        kind = "text" if values.dtype.kind in "OSU" else str(values.dtype)
        example = f", first {shown(values.flat[0])}" if values.size else ""
        raise InputError(f"{path}: {column} holds {kind}{example}; wanted real numbers")
    if values.ndim == 2 and 1 in values.shape:
        values = values.ravel()
    if values.ndim != 1:
        raise InputError(f"{path}: {column} has shape {values.shape}; wanted one column, as in 'name[0]'")
    return values.astype(np.float64)


def as_labels(path: Path, column: Column, values: Any) -> tuple[str, ...]:
    """One column as texts; numbers count as labels too."""
    values = np.ravel(np.asarray(values))
    if values.dtype.kind == "S":
        values = np.char.decode(values, "utf-8", "replace")
    if values.dtype.kind == "O":
        values = np.array(["" if np.size(v) == 0 else v for v in values], dtype=object)  # MATLAB's '' is an array
    if values.dtype.kind == "O" and not all(isinstance(v, str) for v in values):
        raise InputError(f"{path}: {column} holds objects; wanted labels as text or numbers")
    return tuple(f"{v:g}" if values.dtype.kind == "f" else str(v) for v in values.tolist())


def check_size(path: Path, unfolded: float, stored: float) -> None:
    """Refuse a file that unfolds to much more than it is, as no measurements do; sizes in bytes.

    Raises
    ------
    InputError
        If it does.
    """
    if unfolded > MOST_BYTES and unfolded > MOST_FOLDED * stored:
        found = f"{stored / 1e6:.3g} MB that unfold to {unfolded / 1e9:.3g} GB"
        raise InputError(f"{path}: {found}; wanted measurements, which do not fold so small")


@contextmanager
def decoding(path: Path, format_name: str, quiet: bool = False) -> Iterator[None]:
    """Turn whatever a decoder raises on a damaged file into one sentence.

    Decoders of binary formats meet damage with errors of every class (of struct, zlib, ast, their own) and
    with warnings; all of them mean that the file is not what it should be. Of a library that warns of sound files the
    warnings are not listened to (``quiet``).
    """
    try:
        with catch_warnings():
            simplefilter("ignore" if quiet else "error")
            yield
    except InputError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        short = reason if len(reason) <= 120 else f"{reason[:117]}..."
        raise InputError(f"{path}: cannot be read as {format_name} ({short}); wanted an undamaged file") from None
