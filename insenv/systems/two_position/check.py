"""What a scenario must have for a two-position calibration: a vehicle that turns, a sight, and an Earth that turns."""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.plants.vehicle import Vehicle
from insenv.scenario import Scenario
from insenv.scenario.task import LEAST_COSINE


def check(scenario: Scenario) -> None:
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
