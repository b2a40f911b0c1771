"""Whether a scenario can give what its ``[task]`` asks for."""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.core.system import kinds, part
from insenv.plants.base import Plant
from insenv.scenario.build import Scenario
from insenv.scenario.spec import TaskSpec

#: Least cosine of latitude and of tilt with which north has a meaning: 0.2 arcsec from the pole.
LEAST_COSINE = 1e-6


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


def turning_table(scenario: Scenario) -> Plant:
    """The table of a scenario whose rate a task commands.

    Raises
    ------
    InputError
        If the plant is no table, or its rate has no limit.
    """
    path, plant = scenario.path, scenario.rig.plant
    assert scenario.task is not None
    if plant.steered_by != "rate":
        raise InputError(
            f"{path}: task.kind = {scenario.task.kind!r} with a [{plant.section}]; wanted a [table] to turn"
        )
    if not np.isfinite(plant.limits.rate):
        raise InputError(f"{path}: table.max_rate is missing; wanted the largest rate, for a [task] commands the rate")
    return plant
