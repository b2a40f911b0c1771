"""All effects, by their names in the contract, and those that installed packages add.

A package adds effects by the entry-point group ``insenv.effects``: its name there is the effect's id. Anywhere else
``module:Name`` names a class, and ``file.py`` the one in a file. What is added is checked as it is loaded
(`insenv.effects.check`).
"""

from __future__ import annotations

from dataclasses import replace
from difflib import get_close_matches
from functools import cache

from insenv.core.errors import InputError
from insenv.core.plugins import EFFECTS, find, is_code, names
from insenv.effects.base import Effect
from insenv.effects.own import ALL, CATALOGUE, RESERVED, TRIAD, TUMBLE

__all__ = ["ALL", "CATALOGUE", "RESERVED", "TRIAD", "TUMBLE", "by_key", "catalogue", "described", "plug_in_of"]


#: Effects that were loaded as code, by their id: findings tell them by it.
_loaded: dict[str, Effect] = {}


def catalogue() -> tuple[Effect, ...]:
    """`CATALOGUE`, and the effects of the installed packages.

    Raises
    ------
    InputError
        If one of them cannot be imported, or is no sound effect.
    """
    return (*CATALOGUE, *(_plug_in(name) for name in names(EFFECTS)))


def described(name: str) -> tuple[str, str, str]:
    """Title and meaning of the effect of an id, and its title on an accelerometer; empty where there are none."""
    if name in RESERVED:
        return *RESERVED[name], ""
    own = next((effect for effect in ALL if effect.id == name), None)
    if own is None and name in names(EFFECTS):
        own = _plug_in(name)
    own = own or _loaded.get(name)
    return ("", "", "") if own is None else (own.title, own.meaning, own.accelerometer_title)


def plug_in_of(effect: Effect) -> str:
    """Where an effect that is none of insenv's own is from, as "module:Name"; else nothing."""
    kind = type(effect)
    return "" if any(type(own) is kind for own in ALL) else f"{kind.__module__}:{kind.__qualname__}"


def by_key(key: str, plug_in: str = "", where: str = "") -> Effect:
    """The effect of an identifier, with its order where one is given: "bias", "bias_temperature:3".

    Parameters
    ----------
    key : str
        Of an effect of insenv, of an entry point, or "module:Name".
    plug_in : str
        "module:Name" that has the effect, where no entry point does.
    where : str
        Where the identifier stands; it opens the message of an error.

    Raises
    ------
    InputError
        If there is no such effect, it has no such order, or one of another package is not sound.
    """
    if not where:
        return _named(key, plug_in)
    try:
        return _named(key, plug_in)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _named(key: str, plug_in: str) -> Effect:
    name, colon, order = key.partition(":")
    found = next((effect for effect in ALL if effect.id == name), None)
    if found is None and is_code(key):
        found = _plug_in(key)
        _loaded[found.id] = found
        return found
    if found is None and (name in names(EFFECTS) or plug_in):
        found = _plug_in(name if name in names(EFFECTS) else plug_in)
    found = _loaded.get(name) if found is None else found
    if found is None:
        known = tuple(dict.fromkeys((*(effect.id for effect in ALL), *names(EFFECTS))))
        near = get_close_matches(name, known, 1)
        all_of = f"wanted one of {', '.join(known)}"
        hint = f"did you mean {near[0]!r}? All: insenv list effects" if near else all_of
        raise InputError(f"unknown effect {key!r}; {hint}")
    if not colon:
        return found
    if not hasattr(found, "order"):
        raise InputError(f"effect {key!r} given, but {name!r} has no order")
    if not (order.isascii() and order.isdecimal() and len(order) < 5):
        raise InputError(f"effect {key!r}: order {order!r} given, wanted a whole number")
    return replace(found, order=int(order))  # type: ignore[call-arg]


@cache
def _plug_in(name: str) -> Effect:
    """An effect of another package, made and checked."""
    from insenv.effects.check import check_effect

    kind = find(EFFECTS, name)
    if not (isinstance(kind, type) and issubclass(kind, Effect)):
        raise InputError(f"effect {name!r} is no effect; wanted a subclass of insenv.effects.base.Effect")
    try:
        effect = kind()
    except Exception as error:
        raise InputError(
            f"effect {name!r} cannot be made ({error!r}); wanted a class that takes no arguments"
        ) from None
    said = check_effect(effect)
    if not is_code(name) and isinstance(effect, Effect) and effect.id != name:
        said = [f"its id is {effect.id!r}; wanted that of its entry point", *said]
    if said:
        more = f" ({len(said) - 1} more: insenv.effects.check.check_effect lists them)" if said[1:] else ""
        raise InputError(f"effect {name!r} ({kind.__module__}): {said[0]}{more}")
    return effect
