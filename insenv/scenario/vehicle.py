"""The vehicle of a scenario and its sight: what they are, what differs from run to run, and what is told of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Sight
from insenv.plants.vehicle import Vehicle
from insenv.plants.vehicle_frame import Slope
from insenv.plants.vehicle_sight import OpticalSight, orientation_error
from insenv.plants.vehicle_sway import Band, Settling, Sway, SwayLine, highest, waves
from insenv.scenario.draws import VEHICLE, generator
from insenv.scenario.schema import RANDOM, ProfileTable, ScenarioTable, SightTable, SwayTable
from insenv.scenario.values import given, not_negative, positive, some, uncertain

#: Largest angle of a slope, of a turn and of what is told of level or installation, at four deviations [rad].
MOST_SLOPE, MOST_TURN, MOST_OFF = np.radians(20.0), np.radians(360.0), np.radians(5.0)

#: Shortest time constant of what settles [s].
LEAST_SETTLING = 1e-3


@dataclass(frozen=True)
class VehicleSpread:
    """Means and standard deviations of what is drawn for a run of a vehicle [rad].

    Attributes
    ----------
    installation, pitch, roll : tuple of float
        Mean and deviation of the installation angle and of the errors of the level that is told.
    orientation, tracking : float
        Deviations of the target's azimuth and of a sighting.
    sight, level : bool
        Whether there is a sight, and whether the level is told.
    lines, band
        Of the sway, whose phases are drawn.
    heading : bool
        Whether the heading is random.
    """

    installation: tuple[float, float] = (0.0, 0.0)
    pitch: tuple[float, float] = (0.0, 0.0)
    roll: tuple[float, float] = (0.0, 0.0)
    orientation: float = 0.0
    tracking: float = 0.0
    sight: bool = False
    level: bool = False
    lines: tuple[SwayLine, ...] = ()
    band: Band | None = None
    heading: bool = False

    @property
    def sight_and_level(self) -> tuple[Sight | None, tuple[float, float]]:
        """What a datasheet says of sight and level: an error is unknown, so that its mean counts as deviation."""
        sight = Sight(self.orientation, self.tracking, float(np.hypot(*self.installation))) if self.sight else None
        level = (float(np.hypot(*self.pitch)), float(np.hypot(*self.roll))) if self.level else (np.inf, np.inf)
        return sight, level

    def drawn(self, plant: Vehicle, seed: int) -> Vehicle:
        """The vehicle of a run."""
        heading, sight, level, sway = (generator(seed, place) for place in VEHICLE)
        if self.heading:
            plant = replace(plant, heading=float(np.pi * (1 - 2 * heading.random())))
        if plant.sight is not None:
            z = sight.standard_normal(2)
            mean, sd = self.installation
            drawn = replace(
                plant.sight, installation=float(mean + sd * z[0]), orientation=float(self.orientation * z[1])
            )
            plant = replace(plant, sight=drawn)
        if self.level:
            z = level.standard_normal(2)
            pitch, roll = (float(m + sd * d) for (m, sd), d in zip((self.pitch, self.roll), z, strict=True))
            plant = replace(plant, level_error=(pitch, roll))
        if self.lines or self.band:
            plant = replace(plant, sway=replace(plant.sway, waves=waves(self.lines, self.band, sway)))
        return plant

    def stacked(self, plants: Sequence[Vehicle]) -> Vehicle:
        """Vehicles of single runs as one batch: what is drawn for a run has shape (R, ...)."""
        first = replace(plants[0], heading=np.array([v.heading for v in plants]))
        if first.sight is not None:
            sights = [v.sight for v in plants if v.sight is not None]
            installation, orientation = (np.array([getattr(s, name) for s in sights]) for name in _DRAWN)
            first = replace(first, sight=replace(first.sight, installation=installation, orientation=orientation))
        if first.level_error is not None:
            pitch, roll = np.array([v.level_error for v in plants]).T.copy()
            first = replace(first, level_error=(pitch, roll))
        if first.sway.waves is not None:
            first = replace(first, sway=replace(first.sway, waves=np.stack([_waves(v) for v in plants])))
        return first

    def shown(self, plant: Vehicle) -> Mapping[str, object]:
        """Heading, sight and level."""
        found: dict[str, object] = {"heading": plant.heading}
        if plant.sight is not None:
            found |= {"installation_angle": plant.sight.installation, "orientation_error": plant.sight.orientation}
        if plant.level_error is not None:
            found["level_error"] = list(plant.level_error)
        return {"vehicle": found}


def vehicle(table: ScenarioTable, shared: dict[str, Any], path: Path) -> tuple[Vehicle, float]:
    """A vehicle, with every uncertain value at its mean, and how long it is watched [s].

    Raises
    ------
    InputError
    """
    named, where = table.vehicle, f"{path}: vehicle"
    assert named is not None
    own = vehicle_spread(table, path)
    slope = given(named.slope, "angle", f"{where}.slope", 0.0)
    if not abs(slope) <= MOST_SLOPE:
        raise InputError(f"{where}.slope = {named.slope!r}; wanted at most 20 deg")
    fixed = _listed(named.deflection, "angle", f"{where}.deflection", 2)
    plant = Vehicle(
        heading=0.0 if own.heading else given(named.heading, "angle", f"{where}.heading", 0.0),
        pitch=_level(named.pitch, f"{where}.pitch"),
        roll=_level(named.roll, f"{where}.roll"),
        max_rate=0.0 if named.max_rate is None else positive(named.max_rate, "rate", f"{where}.max_rate"),
        max_acceleration=0.0
        if named.max_acceleration is None
        else positive(named.max_acceleration, "angular acceleration", f"{where}.max_acceleration"),
        deflection=(fixed[0], fixed[1]),
        slope=Slope(slope, given(named.slope_towards, "angle", f"{where}.slope_towards", 0.0)),
        lever_arm=_arm(named.lever_arm, f"{where}.lever_arm"),
        sway=_sway(named.sway, own, f"{where}.sway"),
        residual=_settling(named.residual, f"{where}.residual"),
        creep=_settling(named.creep, f"{where}.creep"),
        sight=_sight(table.sight, own),
        level_error=(own.pitch[0], own.roll[0]) if own.level else None,
        profile=() if table.profile is None else _turns(table.profile, f"{path}: profile"),
        **shared,
    )
    if (plant.max_rate > 0) != (plant.max_acceleration > 0):
        missing = "max_acceleration" if plant.max_rate > 0 else "max_rate"
        raise InputError(f"{where}.{missing} is missing; wanted both limits of a turn, or none: it cannot turn then")
    try:
        plant.begin()
    except InputError as error:
        raise InputError(f"{path}: {error}; wanted max_rate and max_acceleration in [vehicle]") from None
    return plant, _duration(table, plant, path)


def vehicle_spread(table: ScenarioTable, path: Path) -> VehicleSpread:
    """What differs from run to run of a vehicle.

    Raises
    ------
    InputError
    """
    named, sight = table.vehicle, table.sight
    assert named is not None
    where = f"{path}: vehicle"
    sway = named.sway or SwayTable()
    level = named.level_error or ("0 deg", "0 deg")
    own = VehicleSpread(
        pitch=_off(level[0], f"{where}.level_error[0]"),
        roll=_off(level[1], f"{where}.level_error[1]"),
        level=named.level_error is not None,
        lines=tuple(
            SwayLine(
                positive(line.frequency, "frequency", f"{where}.sway.lines[{i}].frequency"),
                not_negative(line.rms, "angle", f"{where}.sway.lines[{i}].rms"),
            )
            for i, line in enumerate(sway.lines)
        ),
        band=_band(sway, f"{where}.sway.band"),
        heading=named.heading == RANDOM,
    )
    if sight is None:
        return own
    return replace(
        own,
        installation=_off(sight.installation, f"{path}: sight.installation"),
        orientation=_orientation(sight, f"{path}: sight"),
        tracking=not_negative(sight.tracking, "angle", f"{path}: sight.tracking", 0.0),
        sight=True,
    )


_DRAWN = ("installation", "orientation")


def _waves(plant: Vehicle) -> Any:
    assert plant.sway.waves is not None
    return plant.sway.waves


def _orientation(sight: SightTable, where: str) -> float:
    """Deviation of the target's azimuth [rad]."""
    surveyed = sight.position_error is not None or sight.distance is not None
    if surveyed and sight.orientation is not None:
        raise InputError(f"{where} has orientation and surveyed points; wanted one of the two")
    if not surveyed:
        return not_negative(sight.orientation, "angle", f"{where}.orientation", 0.0)
    position = not_negative(sight.position_error, "length", f"{where}.position_error")
    found = orientation_error(position, positive(sight.distance, "length", f"{where}.distance"))
    if not 4 * found <= MOST_OFF:
        raise InputError(f"{where}.distance = {sight.distance!r} is too short for points known to {position:g} m")
    return found


def _off(text: str, where: str) -> tuple[float, float]:
    """A small angle with its deviation [rad]."""
    mean, sd = uncertain(text, "rad", where)
    if not abs(mean) + 4 * sd <= MOST_OFF:
        raise InputError(f"{where} = {text!r}; wanted a small angle, within 5 deg at 4 deviations")
    return mean, sd


def _level(text: str | None, where: str) -> float:
    value = given(text, "angle", where, 0.0)
    if not abs(value) <= MOST_SLOPE:
        raise InputError(f"{where} = {text!r}; wanted at most 20 deg, for a vehicle stands on its wheels")
    return value


def _listed(texts: tuple[str, ...] | None, dimension: str, where: str, length: int) -> list[float]:
    return [
        given(text, dimension, f"{where}[{i}]") for i, text in enumerate(texts or length * [f"0 {_ZERO[dimension]}"])
    ]


_ZERO = {"angle": "rad", "length": "m"}


def _arm(texts: tuple[str, str, str] | None, where: str) -> tuple[float, float, float]:
    right, forward, up = _listed(texts, "length", where, 3)
    return right, forward, up


def _band(sway: SwayTable, where: str) -> Band | None:
    if sway.band is None:
        return None
    low = not_negative(sway.band.low, "frequency", f"{where}.low")
    high = positive(sway.band.high, "frequency", f"{where}.high")
    if not high > low:
        raise InputError(f"{where}.high = {sway.band.high!r}; wanted more than low = {sway.band.low!r}")
    return Band(low, high, not_negative(sway.band.rms, "angle", f"{where}.rms"))


def _sway(table: SwayTable | None, own: VehicleSpread, where: str) -> Sway:
    if table is None:
        return Sway()
    if not (own.lines or own.band):
        raise InputError(f"{where} has no lines and no band; wanted what it sways with")
    axis = given(table.axis, "angle", f"{where}.axis", 0.0)
    return Sway(_arm(table.arm, f"{where}.arm"), axis, waves(own.lines, own.band), highest(own.lines, own.band))


def _settling(table: Any, where: str) -> Settling:
    """Residual motion has a velocity, creep a distance."""
    if table is None:
        return Settling()
    tau = positive(table.time_constant, "time", f"{where}.time_constant")
    if tau < LEAST_SETTLING:
        raise InputError(f"{where}.time_constant = {table.time_constant!r}; wanted at least 1 ms, for less is a knock")
    if hasattr(table, "velocity"):
        return Settling(given(table.velocity, "velocity", f"{where}.velocity"), tau)
    return Settling(given(table.distance, "length", f"{where}.distance") / tau, tau)


def _sight(table: SightTable | None, own: VehicleSpread) -> OpticalSight | None:
    if table is None:
        return None
    return OpticalSight(own.installation[0], 0.0, own.tracking, table.readings == "turns")


def _turns(table: ProfileTable, where: str) -> tuple[tuple[float, float], ...]:
    """Rests, each with the turn after it."""
    if table.kind == "rest":
        return ()
    if table.kind != "turns":
        raise InputError(f"{where}.kind = {table.kind!r} moves a [table]; wanted 'turns' or 'rest' for a [vehicle]")
    found = []
    for i, (rest, angle) in enumerate(some(table.turns, f"{where}.turns")):
        here = f"{where}.turns[{i}]"
        turn = given(angle, "angle", here)
        if not abs(turn) <= MOST_TURN:
            raise InputError(f"{here} = {angle!r}; wanted at most 360 deg")
        found.append((positive(rest, "time", here), turn))
    return tuple(found)


def _duration(table: ScenarioTable, plant: Vehicle, path: Path) -> float:
    """How long a vehicle is watched: as given, else its rests and turns."""
    whole = sum(rest + plant.turn_time(angle) for rest, angle in plant.profile)
    return positive(table.duration, "time", f"{path}: duration", whole or None)
