"""The ``[design]`` of a scenario: what is free within which bounds, with its units taken off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.units import quantity
from insenv.scenario import Scenario, load
from insenv.scenario.schema import DesignTable

Pair = tuple[float, float]


@dataclass(frozen=True)
class Free:
    """What a scenario leaves free.

    Attributes
    ----------
    scenario : Scenario
    given : DesignTable
    """

    scenario: Scenario
    given: DesignTable

    @classmethod
    def of(cls, scenario: Scenario) -> Free:
        """As the scenario says; nothing said: the defaults of its kind."""
        return cls(scenario, scenario.table.design or DesignTable())

    @property
    def step(self) -> float:
        """Of the task [s]."""
        task = self.scenario.task
        assert task is not None
        return task.samples / self.scenario.rig.rate

    @property
    def demanded(self) -> float:
        """What the task demands [SI]."""
        assert self.scenario.task is not None
        return self.scenario.task.demanded

    def where(self, key: str) -> str:
        """Of an entry, for a sentence."""
        return f"{self.scenario.path}: design.{key}"

    def quantity(self, text: object, dimension: str, key: str = "profile") -> float:
        """A quantity of the table [SI]."""
        return quantity(text, dimension, self.where(key))

    def between(self, key: str, dimension: str, default: Pair, limits: Pair) -> Pair:
        """Bounds of a variable [SI], within what the plant can do.

        Raises
        ------
        InputError
            If the bounds that are given are no rising pair, or go beyond the limits.
        """
        given = getattr(self.given, key)
        if given is None:
            low, high = (float(np.clip(value, *limits)) for value in default)
            return min(low, high), high
        low, high = (quantity(text, dimension, f"{self.where(key)}[{i}]") for i, text in enumerate(given))
        slack = 1e-9 * max(abs(limits[1]), 1e-9) if np.isfinite(limits[1]) else 0.0
        if not limits[0] - slack <= low <= high <= limits[1] + slack or (low == high == 0 and key == "rates"):
            wanted = f"the lower bound first, both {_range(limits, dimension)}"
            raise InputError(f"{self.where(key)} = {list(given)!r}; wanted {wanted}")
        return low, high

    def whole(self, key: str, default: tuple[int, int], least: int) -> tuple[int, int]:
        """Bounds of a whole number.

        Raises
        ------
        InputError
            If they do not rise, or begin below ``least``.
        """
        low, high = default if (given := getattr(self.given, key)) is None else given
        if not least <= low <= high <= 64:
            raise InputError(f"{self.where(key)} = [{low}, {high}]; wanted two rising whole numbers from {least} to 64")
        return low, high

    def possible(self, scenario: str, default: tuple[Mapping[str, Any], ...]) -> tuple[Mapping[str, Any], ...]:
        """Effects whose influence is told: as given, else those of the default that the ``scenario`` can have.

        Raises
        ------
        InputError
            If one that is given is none, or the scenario cannot have it.
        """
        if self.given.possible is None:
            there = {*self.scenario.table.declared, *self.scenario.table.undeclared}
            return tuple(one for one in default if one["effect"] not in there and _can_have(scenario, one))
        for one in self.given.possible:
            load(scenario, added(scenario, one))
        return tuple(self.given.possible)


def added(scenario: str, effect: Mapping[str, Any]) -> dict[str, Any]:
    """The change of a scenario that adds an effect to what nobody told of.

    Raises
    ------
    InputError
        If no effect is named.
    """
    if not isinstance(effect.get("effect"), str):
        raise InputError(f"{scenario}: design.possible has {dict(effect)!r}; wanted an effect with its parameters")
    key, entry = effect["effect"], {name: value for name, value in effect.items() if name != "effect"}
    before = load(scenario).table.undeclared.get(key, [])
    return {f"undeclared.{key}": [*(before if isinstance(before, list) else [before]), entry]}


def _can_have(scenario: str, effect: Mapping[str, Any]) -> bool:
    try:
        load(scenario, added(scenario, effect))
    except InputError:
        return False
    return True


def _range(limits: Pair, dimension: str) -> str:
    unit, scale = {"rate": ("deg/s", np.pi / 180), "angle": ("deg", np.pi / 180)}.get(dimension, ("s", 1.0))
    low, high = limits[0] / scale, limits[1] / scale
    return f"from {low:.6g} {unit} on" if not np.isfinite(high) else f"from {low:.6g} to {high:.6g} {unit}"
