"""Recordings on this machine: in the folder that ``INSENV_DATA`` names, else in the cache."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import TYPE_CHECKING

from insenv.core.errors import InputError
from insenv.datasets.registry import SIZES, files

if TYPE_CHECKING:
    from insenv.data.manifest import Manifest

#: Environment variable that names a folder with recordings.
VARIABLE = "INSENV_DATA"


def given_folder() -> Path | None:
    """The folder that ``INSENV_DATA`` names."""
    folder = os.environ.get(VARIABLE)
    return Path(folder).expanduser() if folder else None


def cache() -> Path:
    """Where fetched recordings are kept: the system's place for this user's caches."""
    import pooch  # a fifth of a second, which nobody else should pay

    return Path(pooch.os_cache("insenv"))


def locate(name: str) -> Path | None:
    """Folder that holds the recording ``name``: that of ``INSENV_DATA``, else the cache, else None.

    Raises
    ------
    InputError
        If there is no such recording.
    """
    wanted = [file.path for file in files(name)]
    given = given_folder()
    if given is not None and _holds(given, wanted):
        return given
    return cached if _holds(cached := cache(), wanted) else None


def load(name: str) -> Manifest:
    """Manifest of the recording ``name``, with its data where `locate` finds them.

    Raises
    ------
    InputError
        If there is no such recording, it is not on this machine, or a file is not the one that was published.
    """
    from insenv.data.manifest import load_manifest
    from insenv.datasets.registry import manifest_path

    folder = locate(name)
    if folder is None:
        size = f"{SIZES[name] / 1e6:.1f} MB"
        raise InputError(
            f"the recording {name!r} is not on this machine; wanted it fetched ({size}: "
            f"insenv datasets --fetch {name}) or in the folder that {VARIABLE} names"
        )
    for file in files(name):
        _check(folder / file.path, file.sha256)
    return load_manifest(manifest_path(name), folder=folder)


def _holds(folder: Path, wanted: list[Path]) -> bool:
    return all((folder / path).is_file() for path in wanted)


def _check(path: Path, sha256: str) -> None:
    """Refuse a file that differs from the published one: its figures would be told under the wrong name."""
    try:
        with path.open("rb") as stream:
            found = hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    if found != sha256:
        raise InputError(
            f"{path}: is not the published file (sha256 {found[:12]}..., wanted {sha256[:12]}...); "
            "remove it, or name it in a manifest of your own"
        )
