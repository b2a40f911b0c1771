"""What there is to choose from: the names that commands and files take, kind by kind, with a line each.

effects  scenarios  instruments  estimators  policies  environments  recordings
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from importlib import import_module
from textwrap import wrap

from insenv.core import plugins
from insenv.core.errors import InputError, nearest
from insenv.core.names import KINDS
from insenv.core.system import system, systems


def names(kind: str) -> tuple[str, ...]:
    """Names of a kind.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    if kind not in _NAMES:
        raise InputError(f"no kind {kind!r}; {nearest(kind, KINDS)}")
    return _NAMES[kind]()


def listed(kind: str, width: int = 100) -> str:
    """Names of a kind, with a line each on what it is, in lines of at most ``width``.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    found = names(kind)
    wide = max(map(len, found)) + 2
    lines = []
    for name in found:
        said = wrap(_ABOUT[kind](name), max(30, width - wide)) or [""]
        lines += [f"{name:<{wide}}{said[0]}", *(f"{'':<{wide}}{line}" for line in said[1:])]
    return "\n".join(line.rstrip() for line in lines)


def _first(text: str | None) -> str:
    """The first sentence or line of a docstring or a comment."""
    return " ".join((text or "").strip().split("\n\n")[0].split())


# ------------------------------------------------------------------------------------------------- effects


def _effects() -> tuple[str, ...]:
    from insenv.effects.catalogue import catalogue

    return tuple(dict.fromkeys(effect.id for effect in catalogue()))


def _effect(name: str) -> str:
    from insenv.effects.catalogue import by_key, described

    return described(name)[1] or _first(type(by_key(name)).__doc__)


# ---------------------------------------------------------------------------------- scenarios, instruments


def _scenarios() -> tuple[str, ...]:
    from insenv.scenario.source import names as packaged

    return packaged()


def _scenario(name: str) -> str:
    """The first sentence of the comment at its head."""
    from insenv.scenario.source import path_of

    comment: list[str] = []
    for line in path_of(name).read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        comment.append(line.lstrip("# "))
    return " ".join(comment).partition(". ")[0].rstrip(".")


def _instruments() -> tuple[str, ...]:
    from insenv.sensors import instruments

    made = inspect.getmembers(instruments, inspect.isfunction)
    return tuple(n for n, f in made if f.__annotations__.get("return") == "Instrument" and not n.startswith("_"))


def _instrument(name: str) -> str:
    from insenv.sensors import instruments

    return _first(getattr(instruments, name).__doc__)


# ------------------------------------------------------------------------------------------------ plug-ins


def _estimator(name: str) -> str:
    return _first(plugins.find(plugins.ESTIMATORS, name).__doc__)


def _policy(name: str) -> str:
    return _first(plugins.find(plugins.POLICIES, name).__doc__)


# ------------------------------------------------------------------------------ environments, recordings


def _environment(name: str) -> str:
    """Its id, and the first sentence of its module."""
    one = system(name)
    return f"{one.id}: {_first(import_module(one.environment.partition(':')[0]).__doc__)}"


def _recordings() -> tuple[str, ...]:
    from insenv.datasets import names as published

    return published()


def _recording(name: str) -> str:
    from insenv.datasets import describe

    return describe(name)


_NAMES: Mapping[str, Callable[[], tuple[str, ...]]] = {
    "effects": _effects,
    "scenarios": _scenarios,
    "instruments": _instruments,
    "estimators": lambda: plugins.names(plugins.ESTIMATORS),
    "policies": lambda: plugins.names(plugins.POLICIES),
    "environments": lambda: tuple(systems()),
    "recordings": _recordings,
}
_ABOUT: Mapping[str, Callable[[str], str]] = {
    "effects": _effect,
    "scenarios": _scenario,
    "instruments": _instrument,
    "estimators": _estimator,
    "policies": _policy,
    "environments": _environment,
    "recordings": _recording,
}
