"""Quantities of a scenario: texts with a unit -> SI numbers."""

from __future__ import annotations

from collections.abc import Mapping

from insenv.core.errors import InputError
from insenv.core.manifest.schema import nearest, shown
from insenv.core.units import quantity, quantity_in
from insenv.effects.base import OUTPUT, Effect


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


def parameters(effect: Effect, table: Mapping[str, object], unit: str, where: str) -> tuple[float, ...]:
    """SI values of an effect's parameters, in their order; ``unit`` is that of the output.

    Raises
    ------
    InputError
        If a parameter is missing, unknown, of another dimension or below its least credible value.
    """
    names = [param.name for param in effect.params]
    for name in table:
        if name not in names:
            raise InputError(f"{where}.{name} is no parameter of {effect.key}; {nearest(name, names)}")
    values = []
    for param in effect.params:
        si = param.unit.replace(OUTPUT, unit)
        if param.name not in table:
            raise InputError(f"{where}.{param.name} is missing; wanted a quantity in a unit such as {si!r}")
        value = quantity_in(table[param.name], si, f"{where}.{param.name}")
        if value < param.low:
            raise InputError(f"{where}.{param.name} = {shown(table[param.name])}; wanted {param.low:g} {si} or more")
        values.append(value)
    return tuple(values)
