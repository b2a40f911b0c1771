"""What a scenario must have for a north finder: a table that turns, and a north that it need not be told."""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.plants.base import Plant
from insenv.scenario import Scenario
from insenv.scenario.task import LEAST_COSINE, turning_table


def check(scenario: Scenario) -> None:
    """Refuse a scenario that cannot be played as a north finder, or as the scale-factor test on its table."""
    plant = turning_table(scenario)
    if scenario.task is not None and scenario.task.kind == "north-finder":
        _has_north(scenario, plant)


def _has_north(scenario: Scenario, plant: Plant) -> None:
    """Refuse a north finder that cannot know north, or need not find it."""
    path = scenario.path
    if plant.latitude is None:
        raise InputError(f"{path}: site.latitude is missing; wanted it, for without it the Earth does not turn")
    reason = "the input axis sees no horizontal Earth rate and north has no meaning"
    if np.cos(plant.latitude) < LEAST_COSINE:
        raise InputError(f"{path}: site.latitude = {scenario.table.site.latitude!r}; {reason}; wanted less than 90 deg")
    if np.cos(plant.mounting.tilt) < LEAST_COSINE:
        tilt = scenario.table.table and scenario.table.table.tilt or "90 deg"
        raise InputError(f"{path}: table.tilt = {tilt!r}; {reason}; wanted less than 90 deg")
    if any(p.effect.of_earth and not p.told for p in scenario.planted):
        raise InputError(f"{path}: earth_rate has values of its own, table.azimuth says them; wanted earth_rate = {{}}")
