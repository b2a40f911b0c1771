"""What a scenario tells before anything is measured: figures of the makers, what is declared, site, mounting.

Nothing undeclared is in it, no drawn value, no azimuth and no level error: these are what is sought.
"""

from __future__ import annotations

from insenv.core.estimate import Datasheet, Declared
from insenv.core.units import scale_to_si
from insenv.scenario.build import Scenario
from insenv.scenario.plant import site
from insenv.scenario.schema import UNITS


def datasheet(scenario: Scenario) -> Datasheet:
    """What is known of a scenario's instruments and of their set-up.

    The noise of the encoder is the root sum of squares of its white noise and of its resolution / sqrt(12).
    Gravity is the normal one where the scenario names none. What the plant tells (``earth_rate = {}``) is left
    out: it follows from latitude and tilt, but for the azimuth. Of a vehicle's level and installation angle deviations
    are told, about zero: a scenario that gives a mean has a run in which that is the unknown error. What changes from
    power-up to power-up is part of a declared deviation.
    """
    noise: dict[str, dict[str, float]] = {}
    for p in scenario.planted:
        if p.origin == "noise":
            noise.setdefault(p.target, {})[p.effect.id] = p.values[0]
    declared = tuple(
        Declared(p.effect.key, p.target, p.values, p.spread)
        for p in scenario.planted
        if p.origin == "declared" and not p.told
    )
    plant, table = scenario.rig.plant, scenario.table
    sight, level_sd = scenario.spread.sight_and_level
    return Datasheet(
        sampling=scenario.rig.rate,
        duration=scenario.duration,
        site=site(table, scenario.path),
        mounting=plant.mounting,
        limits=plant.limits,
        noise=noise,
        pulse=_pulse(scenario),
        encoder_noise=plant.encoder_noise,
        declared=declared,
        sight=sight,
        level_sd=level_sd,
        reference_temperature=plant.reference_temperature,
    )


def _pulse(scenario: Scenario) -> float:
    """Weight of a gyro's pulse [rad]."""
    gyro = scenario.table.instrument.gyro
    if not gyro.pulses:
        return 0.0
    return scale_to_si(gyro.unit or UNITS["angle"], "angle", f"{scenario.path}: instrument.gyro.unit")[0]
