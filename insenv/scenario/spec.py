"""The ``[task]`` of a scenario, in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from insenv.core.errors import InputError
from insenv.core.system import kinds
from insenv.core.units import quantity_in
from insenv.scenario.schema import ScenarioTable
from insenv.scenario.values import positive


@dataclass(frozen=True)
class TaskSpec:
    """What the ``[task]`` of a scenario asks for, in steps.

    Attributes
    ----------
    kind : str
        Of a system: "north-finder", "rate-table".
    samples : int
        In a step.
    steps : int
        Until time is up.
    demanded : float
        Standard deviation that is wanted: of the azimuth or the installation angle [rad], of the scale factor [1].
    cost : float
        Price of a second [nats/s].
    range : float
        Largest rate of the line whose slope is sought [rad/s]; infinite where none is given.
    """

    kind: str
    samples: int
    steps: int
    demanded: float
    cost: float
    range: float = np.inf


def task_spec(table: ScenarioTable, samples: int, path: Path) -> TaskSpec | None:
    """The task of a scenario of so many samples, if it has one.

    Raises
    ------
    InputError
        If a quantity is wrong, or a step is no whole number of samples, or the duration none of steps.
    """
    asked, where = table.task, f"{path}: task"
    if asked is None:
        return None
    step = positive(asked.step, "time", f"{where}.step")
    in_step = step * positive(table.instrument.sampling, "frequency", f"{path}: instrument.sampling")
    if not (round(in_step) >= 1 and abs(in_step - round(in_step)) < 1e-6 * in_step):
        raise InputError(f"{where}.step = {asked.step!r} is {in_step:g} samples; wanted a whole number of samples")
    steps, rest = divmod(samples, round(in_step))
    if rest or not steps:
        raise InputError(f"{where}.step = {asked.step!r}; wanted a step that divides the duration evenly")
    if asked.kind not in kinds():
        wanted = " or ".join(repr(name) for name in kinds())
        raise InputError(f"{where}.kind = {asked.kind!r}; wanted one of {wanted}")
    kind = kinds()[asked.kind][1]
    demanded = quantity_in(asked.demanded, kind.demanded, f"{where}.demanded")
    if not demanded > 0:
        raise InputError(f"{where}.demanded = {asked.demanded!r}; wanted more than zero")
    if not 0 <= asked.cost < np.inf:
        raise InputError(f"{where}.cost = {asked.cost:g}; wanted a number of nats per second, zero or more")
    if asked.range is not None and not kind.ranged:
        wanted = " or ".join(repr(name) for name, (_, other) in kinds().items() if other.ranged)
        raise InputError(f"{where}.range has no meaning for kind = {asked.kind!r}; wanted it with {wanted}")
    largest = positive(asked.range, "rate", f"{where}.range", np.inf)
    return TaskSpec(asked.kind, round(in_step), steps, demanded, asked.cost, largest)
