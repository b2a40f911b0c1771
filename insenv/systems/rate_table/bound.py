r"""The least deviation of a rate table's scale factor, with the gyro switched off and on in between.

    theta_q = common + own_q,    cov >= g' [M_last + told(N)]^-1 g,    N = sum over earlier q of told(M_q) + P^-1

with M_q what power-up q tells of its own parameters (`insenv.information.scale_factor`), P the declared spread without
that from power-up to power-up, and told(M) = M (I + A M)^-1 what a power-up tells of another, or of what is common: own
values have the variances A, ``[run_to_run]`` of the scenario.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Recording
from insenv.data.power import by_power_up
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.fisher import Bound, Information
from insenv.information.scale_factor import INTERVAL, DeclaredGyro, model, motion_of, slope
from insenv.scenario import Scenario

#: Deviation of what is common that stands for "exact", as a share of that from power-up to power-up.
_EXACT = 1e-5


def bound(
    datasheet: Datasheet, run: Recording, quantities: tuple[str, ...], scenario: Scenario | None
) -> dict[str, float]:
    """Of the slope of the line, where a rate test asks for it [1]; see `insenv.evaluate.bounds`.

    Another task's scale factor is that of the moment, and no slope.
    """
    if ScaleFactor.id not in quantities or scenario is None or scenario.task is None:
        return {}
    if scenario.task.kind != "rate-table":
        return {}
    return {ScaleFactor.id: scale_factor_bound(datasheet, run, scenario)}


def scale_factor_bound(datasheet: Datasheet, run: Recording, scenario: Scenario) -> float:
    """Least standard deviation of K - 1 of the last power-up; infinite where the run does not tell it.

    Parameters
    ----------
    datasheet : Datasheet
    run : Recording
        One run with "table_angle", and "power" where the gyro was switched off and on.
    scenario : Scenario
        Of which the range of rates and what changes from power-up to power-up are taken.
    """
    assert scenario.task is not None
    try:
        least, told = parameters_bound(datasheet, run, run_to_run(scenario))
    except InputError:
        return np.inf
    weights, _ = slope(told, datasheet, min(scenario.task.range, datasheet.limits.rate))
    named = {name: weight for name, weight in weights.items() if weight and name in least.names}
    if not named:
        return np.inf
    g = np.array(list(named.values()))
    variance = float(g @ least.block(tuple(named)) @ g)
    return float(np.sqrt(variance)) if np.isfinite(variance) else np.inf


def run_to_run(scenario: Scenario) -> dict[str, float]:
    """Deviations of the gyro's declared parameters from power-up to power-up, by names such as "bias.c"."""
    return {
        f"{p.effect.key}.{param.name}": sd
        for p in scenario.planted
        if p.target == "gyro" and p.origin == "declared" and p.again
        for param, sd in zip(p.effect.params, p.again, strict=True)
    }


def parameters_bound(datasheet: Datasheet, run: Recording, again: Mapping[str, float]) -> tuple[Bound, DeclaredGyro]:
    """Bound of all declared parameters of the last power-up.

    Raises
    ------
    InputError
        If the datasheet tells of no noise, or there is less than an interval of data.
    """
    *earlier, last = [_information(datasheet, part) for part in by_power_up([run])]
    found, told = last
    if not any(again.values()):
        return found.given(told.sd).bound(), told
    common = {
        name: float(np.sqrt(max(sd**2 - again.get(name, 0.0) ** 2, (_EXACT * again.get(name, 0.0)) ** 2)))
        for name, sd in told.sd.items()
    }
    known = {name: 0.0 for name, sd in common.items() if not sd > 0}
    total = found.given(known)
    before = Information(total.names, np.zeros_like(total.matrix)).given({n: sd for n, sd in common.items() if sd > 0})
    for part, _ in earlier:
        before = before + part.given(known).anew(again)
    return (total + before.anew(again)).bound(), told


def _information(datasheet: Datasheet, part: Recording) -> tuple[Information, DeclaredGyro]:
    """What one power-up tells of its own parameters, from every so many of its rows."""
    rows = max(1, round(INTERVAL / part.dt))
    angle = part.values("table_angle", "rad")[::rows]
    temperature = part.values("temperature", "K")[::rows] if "temperature" in part.channels else None
    means, told = model(datasheet, motion_of(datasheet, angle, rows * part.dt, temperature))
    return means.information, told
