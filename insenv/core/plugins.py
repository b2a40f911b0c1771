"""Plug-ins by name: an entry point, or ``module:Name``; an effect also by its file, ``file.py:Name``."""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from insenv.core.errors import InputError
from insenv.core.names import CODE_ALLOWED

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: Entry-point groups.
ESTIMATORS, POLICIES, EFFECTS = "insenv.estimators", "insenv.policies", "insenv.effects"
_MODULE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
#: An effect in a file: "my_effect.py", or with its class behind a colon.
_FILE = re.compile(r"(?P<path>.+\.py)(:(?P<name>[A-Za-z_]\w*))?")
_KINDS = {ESTIMATORS: "estimator", POLICIES: "policy", EFFECTS: "effect"}


_allowed = ContextVar("code that files name is allowed", default=False)


@contextmanager
def allow_code(allowed: bool = True) -> Iterator[None]:
    """Within it a manifest, a scenario or a calibration may name code, as "module:Name"."""
    token = _allowed.set(allowed or _allowed.get())
    try:
        yield
    finally:
        _allowed.reset(token)


def is_code(name: str) -> bool:
    """Whether a name of a plug-in is that of code: "module:Name", or a file of Python."""
    return bool(_MODULE.fullmatch(name) or _FILE.fullmatch(name))


def beside(name: str, folder: Path) -> str:
    """The name of a plug-in in a file, with the path from ``folder``; any other name as it is."""
    found = _FILE.fullmatch(name)
    return name if found is None else f"{folder / found['path']}{found[2] or ''}"


def check_code(name: str, where: str) -> None:
    """Refuse "module:Name" in a file: reading data is to run no code, unless whoever reads them allows it.

    Raises
    ------
    InputError
        If ``name`` is one and `allow_code` does not hold; ``where`` opens the message.
    """
    if not is_code(name) or _allowed.get() or os.environ.get(CODE_ALLOWED) == "1":
        return
    wanted = "wanted --allow-code (allow_code in Python), or an effect of an installed package by its name"
    raise InputError(f"{where} names {name!r}, which is code; {wanted}")


def names(group: str) -> tuple[str, ...]:
    """Names of the plug-ins that are installed, sorted."""
    return tuple(sorted(installed(group)))


def find(group: str, name: str) -> Callable[..., Any]:
    """The class of a plug-in, or what adapts it where it keeps its state in itself (`insenv.core.stateful`).

    Parameters
    ----------
    group : str
        `ESTIMATORS`, `POLICIES` or `EFFECTS`.
    name : str
        Of an entry point, or "module:Name".

    Raises
    ------
    InputError
        If there is none of that name, or it cannot be imported.
    """
    kind = _KINDS[group]
    if not isinstance(name, str):
        raise InputError(f"{kind} of type {type(name).__name__} given; wanted its name, a text")
    if group == EFFECTS and (file := _FILE.fullmatch(name)):
        return _of_file(Path(file["path"]), file["name"])
    module, colon, attribute = name.partition(":")
    if colon:
        return _imported(kind, name, module, attribute)
    if point := installed(group).get(name):
        return _imported(kind, name, point.module, point.attr)
    known = names(group)
    near = get_close_matches(name, known, 1)
    wanted = f"did you mean {near[0]!r}?" if near else f"wanted one of {', '.join(known)}, or module:Name"
    raise InputError(f"{kind} {name!r} is not installed; {wanted}")


@cache
def installed(group: str) -> dict[str, EntryPoint]:
    """Entry points of a group by name; read once, for it costs milliseconds."""
    from importlib.metadata import entry_points

    return {point.name: point for point in entry_points(group=group)}


def _of_file(path: Path, wanted: str | None) -> Callable[..., Any]:
    """The class of that name in a file; the one class with an ``id`` that stands in it, where no name is given."""
    module = _loaded(path.resolve())
    own = {k: v for k, v in vars(module).items() if isinstance(v, type) and v.__module__ == module.__name__}
    if wanted is not None:
        if wanted not in own:
            raise InputError(f"{path}: has no class {wanted!r}; wanted one of {', '.join(own) or 'the effects in it'}")
        return own[wanted]
    found = [kind for kind in own.values() if getattr(kind, "id", "")]
    if len(found) != 1:
        raise InputError(f"{path}: has {len(found)} effects; wanted one, or its name behind a colon: {path.name}:Name")
    return found[0]


def _loaded(path: Path) -> ModuleType:
    """The module of a file, run once; it goes by its path, by which whatever keeps its classes finds it again."""
    name = str(path)
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise InputError(f"{path}: no such file; wanted one of Python with an effect in it")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever another author's code raises
        del sys.modules[name]
        raise InputError(f"{path}: cannot be run ({error!r}); wanted a file of Python with an effect in it") from None
    return module


def _imported(kind: str, name: str, module: str, attribute: str) -> Callable[..., Any]:
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise InputError(f"{kind} {name!r} cannot be imported ({error}); wanted an importable module:Name") from None
    if not callable(found):
        raise InputError(f"{kind} {name!r} is a {type(found).__name__}; wanted a class")
    from insenv.core.stateful import adapted  # here: it brings NumPy, which naming plug-ins does not need

    return found if kind == "effect" else adapted(found)
