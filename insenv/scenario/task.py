"""What an environment asks for: the ``[task]`` of a scenario, and whether the scenario can give it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from insenv.core.errors import InputError
from insenv.core.system import kinds, part
from insenv.core.units import quantity_in
from insenv.plants.turntable import Turntable
from insenv.plants.vehicle import Vehicle
from insenv.scenario.schema import ScenarioTable
from insenv.scenario.values import positive

if TYPE_CHECKING:
    from insenv.scenario.build import Scenario

#: Least cosine of latitude and of tilt with which north has a meaning: 0.2 arcsec from the pole.
LEAST_COSINE = 1e-6


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


def task(table: ScenarioTable, samples: int, path: Path) -> TaskSpec | None:
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


def check_task(scenario: Scenario) -> TaskSpec:
    """The task of a scenario that can be played in an environment.

    Raises
    ------
    InputError
        If there is no task, or its system refuses the scenario (`insenv.core.system.System.check`).
    """
    path = scenario.path
    if scenario.task is None:
        raise InputError(f"{path}: [task] is missing; wanted what an environment asks for")
    part(kinds()[scenario.task.kind][0].check)(scenario)
    return scenario.task


def turning_table(scenario: Scenario) -> Turntable:
    """The table of a scenario whose rate a task commands.

    Raises
    ------
    InputError
        If the plant is no table, or its rate has no limit.
    """
    path, plant = scenario.path, scenario.rig.plant
    assert scenario.task is not None
    if not isinstance(plant, Turntable):
        found = "a [vehicle]" if isinstance(plant, Vehicle) else "a [base]"
        raise InputError(f"{path}: task.kind = {scenario.task.kind!r} with {found}; wanted a [table] to turn")
    if not np.isfinite(plant.max_rate):
        raise InputError(f"{path}: table.max_rate is missing; wanted the largest rate, for a [task] commands the rate")
    return plant
