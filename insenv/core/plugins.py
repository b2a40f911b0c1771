"""Plug-ins by name: an entry point, or ``module:Name``."""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from functools import cache
from typing import TYPE_CHECKING, Any

from insenv.core.errors import InputError
from insenv.core.names import CODE_ALLOWED

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: Entry-point groups.
ESTIMATORS, POLICIES, EFFECTS = "insenv.estimators", "insenv.policies", "insenv.effects"
_MODULE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
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


def check_code(name: str, where: str) -> None:
    """Refuse "module:Name" in a file: reading data is to run no code, unless whoever reads them allows it.

    Raises
    ------
    InputError
        If ``name`` is one and `allow_code` does not hold; ``where`` opens the message.
    """
    if not _MODULE.fullmatch(name) or _allowed.get() or os.environ.get(CODE_ALLOWED) == "1":
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


def _imported(kind: str, name: str, module: str, attribute: str) -> Callable[..., Any]:
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError, TypeError) as error:
        raise InputError(f"{kind} {name!r} cannot be imported ({error}); wanted an importable module:Name") from None
    if not callable(found):
        raise InputError(f"{kind} {name!r} is a {type(found).__name__}; wanted a class")
    from insenv.core.stateful import adapted  # here: it brings NumPy, which naming plug-ins does not need

    return found if kind == "effect" else adapted(found)
