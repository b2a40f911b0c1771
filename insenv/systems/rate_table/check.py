"""What a scenario must have for a rate test: a table that turns about what the gyro sees, at rates that it reaches."""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.scenario import Scenario
from insenv.scenario.task import LEAST_COSINE, turning_table


def check(scenario: Scenario) -> None:
    """Refuse a rate test of a gyro that does not see the table turn, or beyond what the table reaches."""
    plant = turning_table(scenario)
    table, asked = scenario.table.table, scenario.table.task
    if abs(np.sin(plant.mounting.tilt)) < LEAST_COSINE:
        found = f"table.tilt = {table.tilt!r}" if table else "table.tilt"
        raise InputError(f"{scenario.path}: {found}; the gyro does not see the table turn; wanted more than 0 deg")
    assert scenario.task is not None and asked is not None
    if asked.range is not None and scenario.task.range > plant.limits.rate * (1 + 1e-9):
        limit = f"{np.degrees(plant.limits.rate):.6g} deg/s"
        raise InputError(f"{scenario.path}: task.range = {asked.range!r}; the table reaches {limit}")
