"""What a scenario must have for the calibration of a unit: a table of several axes, and something that is not known."""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.information.unit.calibration import sought
from insenv.scenario import Scenario, datasheet
from insenv.systems.system_calibration.plant import MultiAxisTable


def check(scenario: Scenario) -> None:
    """Refuse another plant, a table that no unit can be set to, and a unit of which all is known."""
    path, plant = scenario.path, scenario.rig.plant
    if not isinstance(plant, MultiAxisTable):
        raise InputError(f"{path}: task.kind = 'system-calibration' without [axes]; wanted a table of several axes")
    if not (np.isfinite(plant.max_rate) and np.isfinite(plant.max_acceleration)):
        raise InputError(f"{path}: axes.max_rate or axes.max_acceleration has no limit; wanted both finite")
    if not sought(datasheet(scenario)):
        raise InputError(
            f"{path}: [declared] has no parameter with a deviation, such as bias = {{ c = '+- 1 deg/h' }}; wanted one "
            "that is sought"
        )
