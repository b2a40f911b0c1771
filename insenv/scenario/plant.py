"""The plant of a scenario: a turntable with its profile, a base at rest or a vehicle; and what it entails."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.earth import gravity
from insenv.core.errors import InputError
from insenv.core.recording import Site
from insenv.core.units import STANDARD_GRAVITY, quantity_in
from insenv.effects.base import Effect
from insenv.plants import profile as profiles
from insenv.plants import thermal
from insenv.plants.base import Plant
from insenv.plants.static import Disturbance, StaticBase
from insenv.plants.turntable import Encoder, Ripple, Turntable
from insenv.scenario.schema import RANDOM, ProfileTable, ScenarioTable, TemperatureTable, TurntableTable
from insenv.scenario.values import given, not_negative, positive, some, uncertain
from insenv.scenario.vehicle import vehicle

#: Keys of each profile.
PROFILES: Mapping[str, tuple[str, ...]] = {
    "constant": ("rate",),
    "staircase": ("rates", "dwell"),
    "reversal": ("rate", "dwell", "cycles"),
    "sine": ("amplitude", "frequency", "rate"),
    "rest": (),
    "steps": ("steps",),
}
#: Keys of each temperature.
TEMPERATURES: Mapping[str, tuple[str, ...]] = {
    "constant": ("value",),
    "ramp": ("start", "end", "slope"),
    "warm_up": ("start", "rise", "time_constant"),
    "cycle": ("levels", "slope", "soak"),
    "points": ("points",),
}
#: Largest level error of a table: rotations about two axes still add [rad].
MOST_LEVEL_ERROR = np.radians(1.0)
#: Keys that may be left out.
_OPTIONAL: Mapping[str, tuple[str, ...]] = {"sine": ("rate",), "reversal": ("cycles",)}


def build(table: ScenarioTable, path: Path) -> tuple[Plant, float]:
    """The plant and how long it is watched [s].

    Raises
    ------
    InputError
    """
    there = [name for name in ("table", "base", "vehicle") if getattr(table, name) is not None]
    if len(there) != 1:
        found = f"both of {' and '.join(f'[{name}]' for name in there[:2])}" if there else "none of them"
        wanted = "the one of [table], [base] and [vehicle] that carries the instruments"
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
    if table.vehicle is not None:
        return vehicle(table, shared | {"altitude": place.altitude}, path)
    return _base(table, shared, path) if table.table is None else _turntable(table, shared, path)


def level_error(table: ScenarioTable, path: Path) -> tuple[tuple[float, float], tuple[float, float]]:
    """Means and standard deviations of the table's level error about east and north [rad].

    Raises
    ------
    InputError
    """
    given_, where = None if table.table is None else table.table.level_error, f"{path}: table.level_error"
    if given_ is None:
        return (0.0, 0.0), (0.0, 0.0)
    (east, east_sd), (north, north_sd) = (uncertain(text, "rad", f"{where}[{i}]") for i, text in enumerate(given_))
    # Beyond it the rotations about two axes do not add any more.
    for i, most in enumerate((abs(east) + 4 * east_sd, abs(north) + 4 * north_sd)):
        if most > MOST_LEVEL_ERROR:
            raise InputError(f"{where}[{i}] = {given_[i]!r}; wanted a small angle, within 1 deg at 4 deviations")
    return (east, north), (east_sd, north_sd)


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


def told_by(plant: Plant, effect: Effect) -> tuple[float, ...] | None:
    """Parameters of ``effect`` where the plant itself tells them: gravity, the horizontal Earth rate."""
    if effect.id == "base_tilt" and isinstance(plant, StaticBase):
        return (plant.gravity, *(0.0 for _ in effect.params[1:]))
    if effect.id == "earth_rate" and isinstance(plant, Turntable) and plant.latitude is not None:
        c, s = plant.horizontal_earth_rate
        return float(c), float(s)
    return None


def entailed(plant: Plant) -> list[tuple[str, str]]:
    """Effects that the plant must have, and why."""
    if isinstance(plant, Turntable) and np.hypot(*plant.horizontal_earth_rate) > 1e-12:
        return [("earth_rate", "the input axis is not vertical and sees the Earth turn")]
    if isinstance(plant, StaticBase) and plant.disturbance.sd > 0:
        return [("base_tilt", "the base tilts and the accelerometers read gravity times it")]
    return []


def _latitude(text: str, where: str) -> float:
    value = given(text, "angle", where)
    if abs(value) > np.pi / 2 + 1e-9:
        raise InputError(f"{where} = {text!r}; wanted from -90 deg to 90 deg")
    return value


def _only(table: ProfileTable | TemperatureTable, keys: tuple[str, ...], where: str) -> None:
    """Refuse keys that mean nothing for the table's kind, and miss those that do."""
    present = {n for n in table.__struct_fields__ if n != "kind" and getattr(table, n) is not None}
    for name in sorted(present - set(keys)):
        wanted = ", ".join(keys) or "no other key"
        raise InputError(f"{where}.{name} has no meaning for kind = {table.kind!r}; wanted {wanted}")
    for name in keys:
        if name not in present and name not in _OPTIONAL.get(table.kind, ()):
            raise InputError(f"{where}.{name} is missing; kind = {table.kind!r} needs it")


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


def _turntable(table: ScenarioTable, shared: dict[str, Any], path: Path) -> tuple[Plant, float]:
    """A turntable that follows its profile."""
    turntable, where = table.table, f"{path}: table"
    assert turntable is not None
    if table.profile is None and table.task is None:
        raise InputError(f"{path}: [profile] is missing; wanted what the table is commanded to do, or a [task]")
    profile = profiles.rest(np.inf) if table.profile is None else _profile(table.profile, f"{path}: profile")
    known = profiles.duration(profile)
    duration = positive(table.duration, "time", f"{path}: duration", known if np.isfinite(known) else None)
    drawn = turntable.azimuth == RANDOM
    plant = Turntable(
        tilt=given(turntable.tilt, "angle", f"{where}.tilt", np.pi / 2),
        azimuth=0.0 if drawn else uncertain(turntable.azimuth or "0 deg", "rad", f"{where}.azimuth")[0],
        max_rate=positive(turntable.max_rate, "rate", f"{where}.max_rate", np.inf),
        max_acceleration=positive(
            turntable.max_acceleration, "angular acceleration", f"{where}.max_acceleration", np.inf
        ),
        ripple=_ripple(table, f"{where}.ripple"),
        encoder=_encoder(turntable, f"{where}.encoder"),
        profile=profile,
        level_error=level_error(table, path)[0],
        carries=("gyro",) if table.instrument.accel is None else ("gyro", "accel_x"),
        **shared,
    )
    try:
        plant.begin()
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return plant, duration


def _encoder(turntable: TurntableTable, where: str) -> Encoder:
    encoder = turntable.encoder
    return Encoder(
        resolution=not_negative(encoder.resolution, "angle", f"{where}.resolution", 0.0),
        noise=not_negative(encoder.noise, "angle", f"{where}.noise", 0.0),
        eccentricity=given(encoder.eccentricity, "angle", f"{where}.eccentricity", 0.0),
        phase=given(encoder.phase, "angle", f"{where}.phase", 0.0),
        skew=not_negative(encoder.skew, "time", f"{where}.skew", 0.0),
    )


def _ripple(table: ScenarioTable, where: str) -> Ripple:
    assert table.table is not None
    if (ripple := table.table.ripple) is None:
        return Ripple()
    fraction = given(ripple.fraction, "fraction", f"{where}.fraction")
    if not 0 <= fraction < 1 or ripple.order < 1:
        found = f"fraction {fraction:g}, order {ripple.order}"
        raise InputError(f"{where} has {found}; wanted a fraction from 0 to below 1 and an order from 1")
    return Ripple(fraction, ripple.order)


def _profile(table: ProfileTable, where: str) -> profiles.Profile:
    """Commands of the table, some of them without end."""
    if table.kind == "turns":
        raise InputError(f"{where}.kind = 'turns' turns a [vehicle]; wanted another kind for a [table]")
    _only(table, PROFILES[table.kind], where)

    def rate(text: object, key: str) -> float:
        return given(text, "rate", f"{where}.{key}")

    if table.kind == "constant":
        return profiles.constant(rate(table.rate, "rate"), np.inf)
    if table.kind == "rest":
        return profiles.rest(np.inf)
    if table.kind == "sine":
        frequency = positive(table.frequency, "frequency", f"{where}.frequency")
        centre = given(table.rate, "rate", f"{where}.rate", 0.0)
        return profiles.sine(rate(table.amplitude, "amplitude"), frequency, np.inf, centre)
    if table.kind == "steps":
        return _steps(table, where)
    dwell = positive(table.dwell, "time", f"{where}.dwell")
    if table.kind == "reversal":
        cycles = 1 if table.cycles is None else table.cycles
        if not 1 <= cycles <= 100_000:
            raise InputError(f"{where}.cycles = {cycles}; wanted from 1 to 100000")
        return profiles.reversal(rate(table.rate, "rate"), dwell, cycles)
    rates = [rate(text, f"rates[{i}]") for i, text in enumerate(table.rates or [])]
    return profiles.staircase(some(rates, f"{where}.rates"), dwell)


def _steps(table: ProfileTable, where: str) -> profiles.Profile:
    """Pairs of duration and rate."""
    steps = tuple(
        profiles.Piece(positive(time, "time", f"{where}.steps[{i}]"), given(rate, "rate", f"{where}.steps[{i}]"))
        for i, (time, rate) in enumerate(table.steps or [])
    )
    return some(steps, f"{where}.steps")


def _temperature(table: TemperatureTable | None, where: str) -> thermal.Temperature:
    """Temperature of the instrument; the reference temperature where none is given."""
    if table is None:
        return thermal.Constant()
    _only(table, TEMPERATURES[table.kind], where)

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
