"""The least deviation of every parameter of a unit, for the motion that was played."""

from __future__ import annotations

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Recording
from insenv.information.unit.calibration import UnitModel, run_information
from insenv.scenario import Scenario


def bound(
    datasheet: Datasheet, run: Recording, quantities: tuple[str, ...], scenario: Scenario | None
) -> dict[str, float]:
    """Of each parameter that is sought, its deviation before the data in it [SI]; see `insenv.evaluate.bounds`."""
    if datasheet.mounting.gimbals is None or "axis_1" not in run.channels:
        return {}
    try:
        model = UnitModel(datasheet)
    except InputError:
        return {}
    matrix = run_information(model, run)
    sd = np.array([parameter.sd for parameter in model.parameters])
    least = sd * np.sqrt(np.diag(np.linalg.inv(np.eye(len(sd)) + matrix)))
    found = {p.name: float(value) for p, value in zip(model.parameters, least, strict=True)}
    return {name: found[name] for name in quantities if name in found}
