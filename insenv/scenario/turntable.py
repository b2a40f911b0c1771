"""The turntable of a scenario: what it is, its profile, and what differs from run to run."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Sight
from insenv.plants import profile as profiles
from insenv.plants.turntable import Encoder, Ripple, Turntable
from insenv.scenario.draws import AZIMUTH, LEVEL, generator
from insenv.scenario.schema import RANDOM, ProfileTable, ScenarioTable, TurntableTable
from insenv.scenario.values import PLUS_MINUS, given, not_negative, only, positive, some, uncertain

#: Keys of each profile.
PROFILES: Mapping[str, tuple[str, ...]] = {
    "constant": ("rate",),
    "staircase": ("rates", "dwell"),
    "reversal": ("rate", "dwell", "cycles"),
    "sine": ("amplitude", "frequency", "rate"),
    "rest": (),
    "steps": ("steps",),
}
#: Keys that may be left out.
_OPTIONAL: Mapping[str, tuple[str, ...]] = {"sine": ("rate",), "reversal": ("cycles",)}
#: Largest level error of a table: rotations about two axes still add [rad].
MOST_LEVEL_ERROR = np.radians(1.0)


@dataclass(frozen=True)
class TableSpread:
    """What is drawn for a run of a turntable.

    Attributes
    ----------
    azimuth_sd : float
        Deviation of the azimuth [rad]; infinite where it is uniform on the circle.
    level_sd : pair of float
        Of the level error about east and north [rad].
    azimuth, level : bool
        Whether the truth of a run tells the azimuth and the level error.
    """

    azimuth_sd: float = 0.0
    level_sd: tuple[float, float] = (0.0, 0.0)
    azimuth: bool = False
    level: bool = False

    @property
    def sight_and_level(self) -> tuple[Sight | None, tuple[float, float]]:
        """No sight, and no level that is told."""
        return None, (np.inf, np.inf)

    def drawn(self, plant: Turntable, seed: int) -> Turntable:
        """The table with its azimuth, uniform on the circle or near what is given, and its level error."""
        if self.azimuth_sd == np.inf:
            plant = replace(plant, azimuth=float(np.pi * (1 - 2 * generator(seed, AZIMUTH).random())))
        elif self.azimuth_sd:
            off = self.azimuth_sd * generator(seed, AZIMUTH).standard_normal()
            plant = replace(plant, azimuth=float(plant.azimuth + off))
        if any(self.level_sd):
            z = generator(seed, LEVEL).standard_normal(2)
            east, north = (float(m + s * d) for m, s, d in zip(plant.level_error, self.level_sd, z, strict=True))
            plant = replace(plant, level_error=(east, north))
        return plant

    def stacked(self, plants: Sequence[Turntable]) -> Turntable:
        """Tables of single runs as one, azimuth and level error of shape (R,)."""
        first = replace(plants[0], azimuth=np.array([plant.azimuth for plant in plants]))
        if not any(self.level_sd):
            return first
        east, north = np.array([plant.level_error for plant in plants]).T.copy()
        return replace(first, level_error=(east, north))

    def shown(self, plant: Turntable) -> Mapping[str, object]:
        """Azimuth and level error, where they are no figures of the scenario or are errors."""
        found: dict[str, object] = {"azimuth": plant.azimuth} if self.azimuth else {}
        if self.level:
            found["level_error"] = list(plant.level_error)
        return {"table": found} if found else {}


def table_spread(table: ScenarioTable, path: Path) -> TableSpread:
    """What differs from run to run of a table.

    Raises
    ------
    InputError
    """
    named = table.table
    assert named is not None
    text = named.azimuth or "0 deg"
    sd = np.inf if text == RANDOM else uncertain(text, "rad", f"{path}: table.azimuth")[1]
    shown = text == RANDOM or re.search(PLUS_MINUS, text) is not None
    return TableSpread(sd, _level_error(table, path)[1], shown, named.level_error is not None)


def turntable(table: ScenarioTable, shared: dict[str, Any], path: Path) -> tuple[Turntable, float]:
    """A turntable that follows its profile, and how long it is watched [s].

    Raises
    ------
    InputError
    """
    named, where = table.table, f"{path}: table"
    assert named is not None
    if table.profile is None and table.task is None:
        raise InputError(f"{path}: [profile] is missing; wanted what the table is commanded to do, or a [task]")
    profile = profiles.rest(np.inf) if table.profile is None else _profile(table.profile, f"{path}: profile")
    known = profiles.duration(profile)
    duration = positive(table.duration, "time", f"{path}: duration", known if np.isfinite(known) else None)
    drawn = named.azimuth == RANDOM
    plant = Turntable(
        tilt=given(named.tilt, "angle", f"{where}.tilt", np.pi / 2),
        azimuth=0.0 if drawn else uncertain(named.azimuth or "0 deg", "rad", f"{where}.azimuth")[0],
        max_rate=positive(named.max_rate, "rate", f"{where}.max_rate", np.inf),
        max_acceleration=positive(named.max_acceleration, "angular acceleration", f"{where}.max_acceleration", np.inf),
        ripple=_ripple(table, f"{where}.ripple"),
        encoder=_encoder(named, f"{where}.encoder"),
        profile=profile,
        level_error=_level_error(table, path)[0],
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
    only(table, PROFILES[table.kind], where, _OPTIONAL.get(table.kind, ()))

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


def _level_error(table: ScenarioTable, path: Path) -> tuple[tuple[float, float], tuple[float, float]]:
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
