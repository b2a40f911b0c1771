"""The plant of a scenario: a turntable, a base at rest or a vehicle; where it stands, how warm it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from insenv.core.earth import gravity
from insenv.core.errors import InputError
from insenv.core.recording import Site
from insenv.core.system import part
from insenv.core.system import plants as systems_plants
from insenv.core.units import STANDARD_GRAVITY, quantity_in
from insenv.effects.base import Effect
from insenv.plants import thermal
from insenv.plants.base import Plant
from insenv.plants.static import Disturbance, StaticBase
from insenv.scenario.draws import Fixed, Spread
from insenv.scenario.schema import ScenarioTable, TemperatureTable
from insenv.scenario.turntable import table_spread, turntable
from insenv.scenario.values import given, not_negative, only, positive, some
from insenv.scenario.vehicle import vehicle, vehicle_spread

#: Keys of each temperature.
TEMPERATURES: Mapping[str, tuple[str, ...]] = {
    "constant": ("value",),
    "ramp": ("start", "end", "slope"),
    "warm_up": ("start", "rise", "time_constant"),
    "cycle": ("levels", "slope", "soak"),
    "points": ("points",),
}


class PlantMaker(Protocol):
    """What makes a plant of a table that a system brings (`insenv.core.system.System.plants`)."""

    def plant(self, table: ScenarioTable, shared: Mapping[str, Any], path: Path) -> tuple[Plant, float]:
        """The plant and how long it is watched [s]; ``shared`` are latitude, gravity and temperatures.

        The table's own entries are in ``table.carriers``, as they are written. Raises InputError.
        """

    def spread(self, table: ScenarioTable, path: Path) -> Spread:
        """What differs from run to run of it. Raises InputError."""


def build(table: ScenarioTable, path: Path) -> tuple[Plant, float]:
    """The plant and how long it is watched [s].

    Raises
    ------
    InputError
    """
    there = [name for name in ("table", "base", "vehicle") if getattr(table, name) is not None] + list(table.carriers)
    if len(there) != 1:
        found = f"both of {' and '.join(f'[{name}]' for name in there[:2])}" if there else "none of them"
        names = ("[table]", "[base]", *(f"[{name}]" for name in systems_plants()), "[vehicle]")
        wanted = f"the one of {', '.join(names[:-1])} and {names[-1]} that carries the instruments"
        raise InputError(f"{path}: {found} given; wanted {wanted}")
    if table.sight is not None and table.vehicle is None:
        raise InputError(f"{path}: [sight] belongs to a [vehicle]; wanted one")
    place = site(table, path)
    shared: dict[str, Any] = {
        "latitude": place.latitude,
        "gravity": place.gravity,
        "temperature": _temperature(table.temperature, f"{path}: temperature"),
        "reference_temperature": given(
            table.instrument.reference_temperature,
            "temperature",
            f"{path}: instrument.reference_temperature",
            298.15,
        ),
    }
    for name in table.carriers:
        return _maker(name).plant(table, shared, path)
    if table.vehicle is not None:
        return vehicle(table, shared | {"altitude": place.altitude}, path)
    return _base(table, shared, path) if table.table is None else turntable(table, shared, path)


def spread(table: ScenarioTable, path: Path) -> Spread:
    """What differs from run to run of the plant.

    Raises
    ------
    InputError
    """
    for name in table.carriers:
        return _maker(name).spread(table, path)
    if table.vehicle is not None:
        return vehicle_spread(table, path)
    return Fixed() if table.table is None else table_spread(table, path)


def _maker(name: str) -> PlantMaker:
    """What makes the plant of a system's own table."""
    made: PlantMaker = part(systems_plants()[name], f"plant of [{name}]")
    return made


def site(table: ScenarioTable, path: Path) -> Site:
    """Where the plant stands. Gravity is as given, else normal gravity, else the standard one.

    Raises
    ------
    InputError
    """
    named, where = table.site, f"{path}: site"
    latitude = None if named.latitude is None else _latitude(named.latitude, f"{where}.latitude")
    altitude = given(named.altitude, "length", f"{where}.altitude", 0.0)
    if named.gravity is not None:
        return Site(latitude, altitude, positive(named.gravity, "acceleration", f"{where}.gravity"))
    return Site(latitude, altitude, STANDARD_GRAVITY if latitude is None else float(gravity(latitude, altitude)))


def known_parameters(plant: Plant, effect: Effect) -> tuple[float, ...] | None:
    """Parameters of ``effect`` where the plant itself tells them: gravity, the horizontal Earth rate."""
    return plant.tells.get(effect.id)


def _latitude(text: str, where: str) -> float:
    value = given(text, "angle", where)
    if abs(value) > np.pi / 2 + 1e-9:
        raise InputError(f"{where} = {text!r}; wanted from -90 deg to 90 deg")
    return value


def _base(table: ScenarioTable, shared: dict[str, Any], path: Path) -> tuple[Plant, float]:
    """A base at rest."""
    base, where = table.base, f"{path}: base"
    assert base is not None
    if table.profile is not None:
        raise InputError(f"{path}: [profile] moves a [table]; a [base] stands still")
    shake = base.disturbance
    plant = StaticBase(
        heading=given(base.heading, "angle", f"{where}.heading", 0.0),
        pitch=given(base.pitch, "angle", f"{where}.pitch", 0.0),
        roll=given(base.roll, "angle", f"{where}.roll", 0.0),
        disturbance=Disturbance()
        if shake is None
        else Disturbance(
            not_negative(shake.sd, "angle", f"{where}.disturbance.sd"),
            positive(shake.time_constant, "time", f"{where}.disturbance.time_constant"),
        ),
        **shared,
    )
    return plant, positive(table.duration, "time", f"{path}: duration")


def _temperature(table: TemperatureTable | None, where: str) -> thermal.Temperature:
    """Temperature of the instrument; the reference temperature where none is given."""
    if table is None:
        return thermal.Constant()
    only(table, TEMPERATURES[table.kind], where)

    def kelvin(text: object, key: str) -> float:
        return positive(text, "temperature", f"{where}.{key}")

    builders: Mapping[str, Callable[[], thermal.Temperature]] = {
        "constant": lambda: thermal.Constant(kelvin(table.value, "value")),
        "ramp": lambda: thermal.Ramp(
            kelvin(table.start, "start"),
            kelvin(table.end, "end"),
            quantity_in(table.slope, "K/s", f"{where}.slope"),
        ),
        "warm_up": lambda: thermal.WarmUp(
            kelvin(table.start, "start"),
            given(table.rise, "temperature difference", f"{where}.rise"),
            positive(table.time_constant, "time", f"{where}.time_constant"),
        ),
        "cycle": lambda: _cycle(table, where),
        "points": lambda: _points(table, where),
    }
    return builders[table.kind]()


def _cycle(table: TemperatureTable, where: str) -> thermal.Points:
    levels = [positive(text, "temperature", f"{where}.levels[{i}]") for i, text in enumerate(table.levels or [])]
    slope = quantity_in(table.slope, "K/s", f"{where}.slope")
    if not slope > 0:
        raise InputError(f"{where}.slope = {table.slope!r}; wanted more than zero")
    return thermal.cycle(some(levels, f"{where}.levels"), slope, not_negative(table.soak, "time", f"{where}.soak"))


def _points(table: TemperatureTable, where: str) -> thermal.Points:
    points = some(table.points, f"{where}.points")
    times = tuple(not_negative(time, "time", f"{where}.points[{i}]") for i, (time, _) in enumerate(points))
    if any(b <= a for a, b in zip(times[:-1], times[1:], strict=True)):
        raise InputError(f"{where}.points has times that do not increase; wanted later times further on")
    values = tuple(positive(value, "temperature", f"{where}.points[{i}]") for i, (_, value) in enumerate(points))
    return thermal.Points(times, values)
