"""Where the results of a sweep stand: in memory, or in a folder that outlives the process.

A folder holds ``sweep.json``, which says whose results these are, and files ``runs-<first>-<stop>.npz`` with the
columns of the runs from ``first`` to before ``stop``, counted from zero. A file appears whole or not at all. Runs that
two files have are taken from the first: the same run gives the same bits.
"""

from __future__ import annotations

import json
import platform
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.files import WRITERS, replacing, write_whole

#: Columns by name: arrays with the runs in front.
Table = Mapping[str, NDArray[Any]]
#: What a sweep runs.
Job = Callable[[Sequence[int]], Table]
#: Runs from the first to before the second.
Span = tuple[int, int]

MANIFEST, LAYOUT = "sweep.json", 1
#: Packages whose version may change the last bit of a result.
_PACKAGES = ("insenv", "numpy", "scipy", "numba")
#: After every ``MANY`` files neighbours of fewer runs than ``SMALL`` are joined, up to ``LARGE`` runs a file.
SMALL, LARGE, MANY = 2**17, 2**20, 256
_NAME = re.compile(r"runs-(\d+)-(\d+)\.npz")


def versions() -> dict[str, str]:
    """Versions of what makes the numbers."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}


@dataclass(frozen=True)
class Identity:
    """Which sweep it is.

    Attributes
    ----------
    job : str
        Name of the function.
    first : int
        Seed of the first run.
    total : int
        Number of runs.
    settings : mapping of str to str
        What else decides on the result, such as a scenario and the hash of its text.
    versions : mapping of str to str
    """

    job: str
    first: int
    total: int
    settings: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=versions)

    def flat(self) -> dict[str, str]:
        """All of it as texts, the settings and versions by their own names."""
        own = {"job": self.job, "first seed": str(self.first), "number of runs": str(self.total)}
        return own | dict(self.settings) | {f"version of {name}": text for name, text in self.versions.items()}


class Store(Protocol):
    """Results of a sweep."""

    def done(self) -> list[Span]:
        """Which runs there are, in order and without overlap."""

    def add(self, start: int, table: Table) -> None:
        """Keep the runs from ``start`` on."""

    def parts(self) -> Iterator[Table]:
        """What there is, run after run."""


class Memory:
    """A store that ends with the process."""

    def __init__(self) -> None:
        self._kept: dict[Span, Table] = {}

    def done(self) -> list[Span]:
        """As of a store."""
        return sorted(self._kept)

    def add(self, start: int, table: Table) -> None:
        """As of a store."""
        self._kept[start, start + rows(table)] = table

    def parts(self) -> Iterator[Table]:
        """As of a store."""
        return (self._kept[span] for span in self.done())


class Folder:
    """A store on disk.

    Parameters
    ----------
    path : Path
        Made where it is missing.
    identity : Identity
    resume : bool
        Whether results of the same sweep may be there.

    Raises
    ------
    InputError
        If it holds another sweep, or this one and ``resume`` is not set, or something else, or cannot be written.
    """

    def __init__(self, path: Path | str, identity: Identity, resume: bool = False) -> None:
        self.path, self.identity = Path(path), identity
        self._added = 0
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{path}: cannot be made a folder ({error.strerror or error})") from None
        if (self.path / MANIFEST).exists():
            self._check(resume)
        elif any(not path.name.endswith(".part") for path in self.path.iterdir()):
            raise InputError(f"{path}: holds files and no {MANIFEST}; wanted an empty folder, or that of a sweep")
        else:
            text = json.dumps({"layout": LAYOUT, **asdict(identity)}, indent=2, ensure_ascii=False)
            write_whole(self.path / MANIFEST, text + "\n")

    def done(self) -> list[Span]:
        """As of a store."""
        return [(span[0] + skip, span[1]) for span, skip in self._files()]

    def add(self, start: int, table: Table) -> None:
        """As of a store."""
        self._write(start, table)
        self._added += 1
        if self._added % MANY == 0:
            self._join()

    def parts(self) -> Iterator[Table]:
        """As of a store.

        Raises
        ------
        InputError
            If a file cannot be read.
        """
        for span, skip in self._files():
            table = self._read(span)
            yield {name: values[skip:] for name, values in table.items()} if skip else table

    def _join(self) -> None:
        """Join small neighbours, so that a long sweep does not end in a million files.

        Killed in between, files are left that the joined one holds too.
        """
        small = [span for span, skip in self._files() if not skip and span[1] - span[0] < SMALL]
        for group in _neighbours(small):
            if len(group) > 1:
                self._write(group[0][0], stacked(self._read(span) for span in group))
                for span in group:
                    self._file(span).unlink()

    def _write(self, start: int, table: Table) -> None:
        with replacing(self._file((start, start + rows(table)))) as temporary:
            WRITERS["npz"](temporary, dict(table))

    def _read(self, span: Span) -> Table:
        path = self._file(span)
        try:
            with np.load(path) as file:
                table = {name: file[name] for name in file.files}
        except (OSError, ValueError, BadZipFile) as error:
            raise InputError(f"{path}: cannot be read ({error}); delete it, and resume the sweep") from None
        if rows(table) != span[1] - span[0]:
            raise InputError(f"{path}: holds {rows(table)} runs; wanted {span[1] - span[0]}, as its name says")
        return table

    def _file(self, span: Span) -> Path:
        return self.path / f"runs-{span[0]:012d}-{span[1]:012d}.npz"

    def _files(self) -> list[tuple[Span, int]]:
        """Spans of the files, in order, each with how many of its runs an earlier one has."""
        matches = (_NAME.fullmatch(path.name) for path in self.path.iterdir())
        spans = [(int(m[1]), int(m[2])) for m in matches if m]
        found, end = [], 0
        # Of files that begin together the longest is first: those that were joined into it add nothing.
        for start, stop in sorted(spans, key=lambda span: (span[0], -span[1])):
            if stop > end:
                found.append(((start, stop), max(end - start, 0)))
                end = stop
        return found

    def _check(self, resume: bool) -> None:
        path = self.path / MANIFEST
        try:
            kept = json.loads(path.read_text(encoding="utf-8"))
            layout = kept.pop("layout")
            there = Identity(**kept).flat()
        except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
            raise InputError(f"{path}: cannot be read ({error}); wanted the {MANIFEST} of a sweep") from None
        if layout != LAYOUT:
            raise InputError(f"{path}: layout {layout!r}; wanted {LAYOUT}, another version of insenv wrote it")
        here = self.identity.flat()
        for name in here | there:
            if here.get(name) != there.get(name):
                raise InputError(
                    f"{self.path}: holds another sweep, its {name} is {there.get(name)} and not {here.get(name)}; "
                    f"wanted the same sweep, or another folder"
                )
        for left in self.path.glob(".*.part"):
            left.unlink(missing_ok=True)  # of a driver that was killed while it wrote
        if not resume and (count := sum(stop - start for start, stop in self.done())):
            raise InputError(
                f"{self.path}: holds {count} of the {self.identity.total} runs of this sweep; "
                f"wanted --resume to go on, or another folder"
            )


def rows(table: Table) -> int:
    """Number of runs of a table."""
    return len(next(iter(table.values())))


def stacked(parts: Iterator[Table] | Sequence[Table]) -> dict[str, NDArray[Any]]:
    """Tables one after the other; an empty one where there is none."""
    listed = list(parts)
    return {name: np.concatenate([part[name] for part in listed]) for name in listed[0]} if listed else {}


def _neighbours(spans: Sequence[Span]) -> Iterator[list[Span]]:
    """Spans that follow on each other without a gap, up to `LARGE` runs."""
    group: list[Span] = []
    for span in spans:
        if group and (span[0] != group[-1][1] or span[1] - group[0][0] > LARGE):
            yield group
            group = []
        group.append(span)
    if group:
        yield group
