"""What an environment asks for: the ``[task]`` of a scenario, and whether the scenario can give it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from insenv.core.errors import InputError
from insenv.core.units import quantity_in
from insenv.plants.turntable import Turntable
from insenv.plants.vehicle import Vehicle
from insenv.scenario.schema import ScenarioTable
from insenv.scenario.values import positive

if TYPE_CHECKING:
    from insenv.scenario.build import Scenario

Kind = Literal["north-finder", "scale-factor-test", "two-position", "rate-table"]
#: SI unit of what each kind of task estimates.
DEMANDED = {"north-finder": "rad", "scale-factor-test": "1", "two-position": "rad", "rate-table": "1"}
#: Least cosine of latitude and of tilt with which north has a meaning: 0.2 arcsec from the pole.
LEAST_COSINE = 1e-6


@dataclass(frozen=True)
class Task:
    """A task in steps.

    Attributes
    ----------
    kind : "north-finder", "scale-factor-test", "two-position" or "rate-table"
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

    kind: Kind
    samples: int
    steps: int
    demanded: float
    cost: float
    range: float = np.inf


def task(table: ScenarioTable, samples: int, path: Path) -> Task | None:
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
    demanded = quantity_in(asked.demanded, DEMANDED[asked.kind], f"{where}.demanded")
    if not demanded > 0:
        raise InputError(f"{where}.demanded = {asked.demanded!r}; wanted more than zero")
    if not 0 <= asked.cost < np.inf:
        raise InputError(f"{where}.cost = {asked.cost:g}; wanted a number of nats per second, zero or more")
    if asked.range is not None and asked.kind != "rate-table":
        raise InputError(f"{where}.range has no meaning for kind = {asked.kind!r}; wanted it with 'rate-table'")
    largest = positive(asked.range, "rate", f"{where}.range", np.inf)
    return Task(asked.kind, round(in_step), steps, demanded, asked.cost, largest)


def check_task(scenario: Scenario) -> Task:
    """The task of a scenario that can be played in an environment.

    Raises
    ------
    InputError
        If there is no task; if the plant is no table whose rate is limited; or, of a north finder, if the gyro
        sees no horizontal Earth rate, for then there is no north, or if the scenario itself says where north is. Of a
        two-position task, if the plant is no vehicle that can turn and has a sight, or the Earth turns about its Up.
    """
    path, plant = scenario.path, scenario.rig.plant
    if scenario.task is None:
        raise InputError(f"{path}: [task] is missing; wanted what an environment asks for")
    if scenario.task.kind == "two-position":
        _can_compass(scenario)
        return scenario.task
    if not isinstance(plant, Turntable):
        found = "a [vehicle]" if isinstance(plant, Vehicle) else "a [base]"
        raise InputError(f"{path}: task.kind = {scenario.task.kind!r} with {found}; wanted a [table] to turn")
    if not np.isfinite(plant.max_rate):
        raise InputError(f"{path}: table.max_rate is missing; wanted the largest rate, for a [task] commands the rate")
    if scenario.task.kind == "north-finder":
        _has_north(scenario, plant)
    if scenario.task.kind == "rate-table":
        _has_rates(scenario, plant)
    return scenario.task


def _can_compass(scenario: Scenario) -> None:
    """Refuse a vehicle that cannot turn, has no sight, or stands where a gyrocompass does not work."""
    path, plant = scenario.path, scenario.rig.plant
    if not isinstance(plant, Vehicle):
        raise InputError(f"{path}: task.kind = 'two-position' without a [vehicle]; wanted one to turn")
    if not plant.turns:
        raise InputError(
            f"{path}: vehicle.max_rate is missing; wanted it and max_acceleration, for a [task] asks for turns"
        )
    if plant.sight is None:
        raise InputError(f"{path}: [sight] is missing; wanted it, for its installation angle is sought")
    if plant.level_error is None:
        raise InputError(
            f"{path}: vehicle.level_error is missing; wanted how well pitch and roll are told at the start"
        )
    if plant.latitude is None:
        raise InputError(f"{path}: site.latitude is missing; wanted it, for without it the Earth does not turn")
    if np.cos(plant.latitude) < LEAST_COSINE:
        found = f"site.latitude = {scenario.table.site.latitude!r}"
        raise InputError(f"{path}: {found}; a gyrocompass finds no heading at a pole; wanted less than 90 deg")


def _has_rates(scenario: Scenario, plant: Turntable) -> None:
    """Refuse a rate test of a gyro that does not see the table turn, or beyond what the table reaches."""
    table, asked = scenario.table.table, scenario.table.task
    if abs(np.sin(plant.tilt)) < LEAST_COSINE:
        found = f"table.tilt = {table.tilt!r}" if table else "table.tilt"
        raise InputError(f"{scenario.path}: {found}; the gyro does not see the table turn; wanted more than 0 deg")
    assert scenario.task is not None and asked is not None
    if asked.range is not None and scenario.task.range > plant.max_rate * (1 + 1e-9):
        limit = f"{np.degrees(plant.max_rate):.6g} deg/s"
        raise InputError(f"{scenario.path}: task.range = {asked.range!r}; the table reaches {limit}")


def _has_north(scenario: Scenario, plant: Turntable) -> None:
    """Refuse a north finder that cannot know north, or need not find it."""
    path = scenario.path
    if plant.latitude is None:
        raise InputError(f"{path}: site.latitude is missing; wanted it, for without it the Earth does not turn")
    reason = "the input axis sees no horizontal Earth rate and north has no meaning"
    if np.cos(plant.latitude) < LEAST_COSINE:
        raise InputError(f"{path}: site.latitude = {scenario.table.site.latitude!r}; {reason}; wanted less than 90 deg")
    if np.cos(plant.tilt) < LEAST_COSINE:
        tilt = scenario.table.table and scenario.table.table.tilt or "90 deg"
        raise InputError(f"{path}: table.tilt = {tilt!r}; {reason}; wanted less than 90 deg")
    if any(p.effect.id == "earth_rate" and not p.told for p in scenario.planted):
        raise InputError(f"{path}: earth_rate has values of its own, table.azimuth says them; wanted earth_rate = {{}}")
