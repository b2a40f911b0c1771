"""Where a scenario's text is: a file, or a packaged one by its name; and what a caller changes in it."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

from insenv.core.errors import InputError
from insenv.core.system import systems
from insenv.data.manifest.schema import shown, tree


@cache
def _packaged() -> Mapping[str, Path]:
    """Files of the systems' scenarios, by name."""
    return {f"{one.home}/{file.stem}": file for one in systems().values() for file in one.scenarios.glob("*.toml")}


def names() -> tuple[str, ...]:
    """Names of the packaged scenarios, sorted: "north_finder/published"."""
    return tuple(sorted(_packaged()))


def path_of(name: str) -> Path:
    """File of the packaged scenario ``name``."""
    return _packaged()[name]


def changed(changes: Mapping[str, Any] | None) -> dict[str, Any]:
    """What a caller changes, as a dict of its own.

    Raises
    ------
    InputError
        If it is no mapping.
    """
    if changes is not None and not isinstance(changes, Mapping):
        raise InputError(f"changes = {shown(changes)}; wanted a mapping such as {{'table.tilt': '90 deg'}}")
    return dict(changes or {})


def source(path: Path | str, changes: Mapping[str, Any] | None) -> tuple[dict[str, Any], Path]:
    """Tree of a scenario with its changes, and the path of its file.

    Raises
    ------
    InputError
        If there is no such file or name, it is not TOML, or a change leads through what is no table.
    """
    name = Path(path).as_posix()
    if name in names():
        path = path_of(name)
    elif not (Path(path).suffix or Path(path).exists()):
        near = get_close_matches(name, names(), 1)
        wanted = f"did you mean {near[0]!r}?" if near else f"wanted a TOML file, or one of {', '.join(names())}"
        raise InputError(f"{name}: neither a file nor a packaged scenario; {wanted}")
    found = tree(Path(path), "scenario")
    for key, value in changed(changes).items():
        _change(found, key, deepcopy(value), Path(path))
    return found, Path(path)


def _change(tree: dict[str, Any], key: object, value: Any, path: Path) -> None:
    """Set the entry at a dotted key; tables on the way are made where they are missing."""
    if not isinstance(key, str) or not all(steps := key.split(".")):
        raise InputError(f"{path}: a change of {shown(key)}; wanted a key such as 'table.tilt'")
    for i, step in enumerate(steps[:-1]):
        tree = tree.setdefault(step, {})
        if not isinstance(tree, dict):
            raise InputError(f"{path}: a change of {key!r}, but {'.'.join(steps[: i + 1])} is no table")
    tree[steps[-1]] = value
