"""Quantities of a scenario: texts with a unit -> SI numbers, some of them with a standard deviation."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from insenv.core.errors import InputError, nearest
from insenv.core.plugins import check_code
from insenv.core.units import quantity, quantity_in
from insenv.data.manifest.schema import shown
from insenv.effects.base import OUTPUT, Effect, Param
from insenv.effects.catalogue import by_key

#: What stands between a mean and its standard deviation.
PLUS_MINUS = r"\+-|±"
#: Standard deviations between an uncertain parameter and its least credible value.
LEAST_DISTANCE = 4.0


def effect_named(key: str, where: str) -> Effect:
    """The effect that a file names at the place ``where``.

    Raises
    ------
    InputError
        If there is no such effect, or it is code and that is not allowed (`insenv.core.plugins.check_code`).
    """
    check_code(key, where)
    return by_key(key, where=where)


def given(text: object, dimension: str, where: str, default: float | None = None) -> float:
    """SI value of ``text``; ``default`` where the key was left out and may be.

    Raises
    ------
    InputError
        If the key is missing and has no default, or the text is no such quantity.
    """
    if text is None:
        if default is None:
            raise InputError(f"{where} is missing; wanted a quantity with its unit ({dimension})")
        return default
    return quantity(text, dimension, where)


def positive(text: object, dimension: str, where: str, default: float | None = None) -> float:
    """As `given`, more than zero."""
    value = given(text, dimension, where, default)
    if not value > 0:
        raise InputError(f"{where} = {shown(text)}; wanted more than zero")
    return value


def not_negative(text: object, dimension: str, where: str, default: float | None = None) -> float:
    """As `given`, zero or more."""
    value = given(text, dimension, where, default)
    if not value >= 0:
        raise InputError(f"{where} = {shown(text)}; wanted zero or more")
    return value


def uncertain(text: object, si: str, where: str) -> tuple[float, float]:
    """Mean and standard deviation, in ``si``: "5 ppm +- 2 ppm", "+- 0.02 arcsec" (mean zero), "5 ppm" (exact).

    The sign may be written "±" too. A bare number stands for a fraction, as everywhere; beside a part that has
    a unit it is refused, for "5 +- 2 ppm" could be meant in two ways.

    Raises
    ------
    InputError
        If a part is no such quantity, or the deviation is missing or negative.
    """
    if not isinstance(text, str) or len(parts := re.split(PLUS_MINUS, text)) == 1:
        return quantity_in(text, si, where), 0.0
    first, last = parts[0].strip(), parts[-1].strip()
    if len(parts) > 2 or not last or (first and _bare(first) != _bare(last)):
        unit = "ppm" if si == "1" else si
        raise InputError(f"{where} = {shown(text)}; wanted a mean and a deviation such as '5 {unit} +- 2 {unit}'")
    deviation = quantity_in(last, si, where)
    if deviation < 0:
        raise InputError(f"{where} = {shown(text)}; wanted a standard deviation of zero or more")
    return quantity_in(first, si, where) if first else 0.0, deviation


def _bare(text: str) -> bool:
    """Whether a text is a number without a unit."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def some(items: Any, where: str) -> Any:
    """A list that is not empty.

    Raises
    ------
    InputError
        If it is.
    """
    if not items:
        raise InputError(f"{where} = []; wanted at least one entry")
    return items


def exact(param: Param, text: object, unit: str, where: str) -> float:
    """SI value of one parameter that nobody may doubt; ``unit`` is that of the output.

    Raises
    ------
    InputError
        If it is of another dimension, below its least credible value, or given with an uncertainty.
    """
    if isinstance(text, str) and re.search(PLUS_MINUS, text):
        raise InputError(f"{where} = {shown(text)}; wanted one value, without an uncertainty")
    return _parameter(param, text, unit, where)[0]


def parameters(
    effect: Effect, table: Mapping[str, object], unit: str, where: str
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Means and standard deviations of an effect's parameters, SI, in their order.

    ``unit`` is that of the output.

    Raises
    ------
    InputError
        If a parameter is missing, unknown, of another dimension or below its least credible value.
    """
    names = [param.name for param in effect.params]
    for name in table:
        if name not in names:
            raise InputError(f"{where}.{name} is no parameter of {effect.key}; {nearest(name, names)}")
    found = []
    for param in effect.params:
        if param.name not in table:
            si = param.unit.replace(OUTPUT, unit)
            raise InputError(f"{where}.{param.name} is missing; wanted a quantity in a unit such as {si!r}")
        found.append(_parameter(param, table[param.name], unit, f"{where}.{param.name}"))
    return tuple(mean for mean, _ in found), tuple(deviation for _, deviation in found)


def _parameter(param: Param, text: object, unit: str, where: str) -> tuple[float, float]:
    """Mean and standard deviation of one parameter."""
    si = param.unit.replace(OUTPUT, unit)
    mean, deviation = uncertain(text, si, where)
    if mean < param.low:
        raise InputError(f"{where} = {shown(text)}; wanted {param.low:g} {si} or more")
    # Nearer to its limit the value would not be Gaussian, and the deviation that is told of it not true.
    if deviation and mean - LEAST_DISTANCE * deviation < param.low:
        wanted = f"a mean {LEAST_DISTANCE:g} standard deviations or more above {param.low:g} {si}"
        raise InputError(f"{where} = {shown(text)}; wanted {wanted}")
    return mean, deviation


def only(table: msgspec.Struct, keys: Sequence[str], where: str, may: Sequence[str] = ()) -> None:
    """Refuse keys that mean nothing for the table's kind, and miss those that do; some ``may`` be left out.

    Raises
    ------
    InputError
    """
    kind = getattr(table, "kind", None)
    present = {n for n in table.__struct_fields__ if n != "kind" and getattr(table, n) is not None}
    for name in sorted(present - set(keys)):
        wanted = ", ".join(keys) or "no other key"
        raise InputError(f"{where}.{name} has no meaning for kind = {kind!r}; wanted {wanted}")
    for name in keys:
        if name not in present and name not in may:
            raise InputError(f"{where}.{name} is missing; kind = {kind!r} needs it")
