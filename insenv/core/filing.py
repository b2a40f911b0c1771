"""What a laboratory files with a result: who, which unit, where, when, from which data, by which command."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterable, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from insenv.core.version import VERSION

_COMMAND: ContextVar[str] = ContextVar("command", default="")
#: Bytes of a file that are hashed at a time.
_CHUNK = 1 << 15


@dataclass(frozen=True)
class DataFile:
    """A file that a result was made from, with the SHA-256 of its bytes, as ``sha256sum`` prints it."""

    name: str
    sha256: str


@dataclass(frozen=True)
class Filing:
    """The head of a page: ``[report]`` of a manifest, as written, and the data files."""

    operator: str = ""
    serial_number: str = ""
    place: str = ""
    date: str = ""
    files: tuple[DataFile, ...] = ()


def hashed(paths: Iterable[Path]) -> tuple[DataFile, ...]:
    """Name and SHA-256 of each file, once; a file that cannot be read any more is left out."""
    found = []
    for path in dict.fromkeys(paths):
        sha = hashlib.sha256()
        try:
            with path.open("rb") as file:
                while chunk := file.read(_CHUNK):
                    sha.update(chunk)
        except OSError:
            continue
        found.append(DataFile(path.name, sha.hexdigest()))
    return tuple(found)


def run_as(arguments: Sequence[str]) -> None:
    """Remember the command line, for the head of what it writes."""
    _COMMAND.set(shlex.join(["insenv", *arguments]))


def command() -> str:
    """The command that runs, as it was typed; empty where insenv is used as a library."""
    return _COMMAND.get()


def stamp() -> dict[str, Any]:
    """Entries of every JSON document: the version of insenv, and the command; null where it is used as a library."""
    return {"version": VERSION, "command": command() or None}


def filed(filing: Filing) -> dict[str, Any]:
    """Entries of a JSON document on a recording: the head of its page, and the data files."""
    said = ("operator", "serial_number", "place", "date")
    return {
        "report": {name: getattr(filing, name) for name in said if getattr(filing, name)},
        "data": [{"file": one.name, "sha256": one.sha256} for one in filing.files],
    }
