"""``[axes]`` of a scenario: a table of two or three axes, and what is drawn of its errors in every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.unit.gimbals import Gimbals
from insenv.core.units import DEG
from insenv.data.manifest.schema import Table, convert
from insenv.scenario.draws import PLACE, generator
from insenv.scenario.schema import ScenarioTable
from insenv.scenario.values import given, not_negative, positive
from insenv.systems.system_calibration.plant import MultiAxisTable

#: Name of the table in a scenario.
NAME = "axes"
#: Place of the draw of the table's errors.
ERRORS = PLACE + 110
#: Largest error of a table [rad]: small turns about three axes still add to a thousandth of themselves.
MOST_ERROR = 1.0 * DEG


class AxesTable(Table):
    """``[axes]``: letters of its ``order`` from the outer to the inner axis, limits, and deviations of its errors.

    ``mounting`` of the unit, ``tilt`` and ``heading_error`` of the base, ``non_orthogonality`` of the axes and
    ``eccentricity`` of the encoders are standard deviations about zero: drawn for every run, and told.
    """

    order: str
    max_rate: str
    max_acceleration: str
    heading: str | None = None
    mounting: str | None = None
    tilt: str | None = None
    heading_error: str | None = None
    non_orthogonality: str | None = None
    eccentricity: str | None = None
    encoder_noise: str | None = None
    most: list[str] | None = None
    longest_dwell: str | None = None


@dataclass(frozen=True)
class AxesSpread:
    """The table's errors, drawn with their deviations."""

    sd: tuple[float, ...]

    @property
    def told(self) -> tuple[None, tuple[float, float]]:
        """No sight, and no level that is told."""
        return None, (np.inf, np.inf)

    def drawn(self, plant: MultiAxisTable, seed: int) -> MultiAxisTable:
        """The table with the errors of a run."""
        return replace(plant, errors=np.array(self.sd) * generator(seed, ERRORS).standard_normal(len(self.sd)))

    def stacked(self, plants: Sequence[MultiAxisTable]) -> MultiAxisTable:
        """Tables of single runs as one, errors of shape (R, q)."""
        return replace(plants[0], errors=np.stack([plant.errors for plant in plants]))

    def shown(self, plant: MultiAxisTable) -> Mapping[str, object]:
        """The errors."""
        return {NAME: dict(zip(plant.gimbals.names, plant.errors.tolist(), strict=True))}


class AxesMaker:
    """Makes the plant of ``[axes]``; see `insenv.scenario.plant.Maker`."""

    def plant(self, table: ScenarioTable, shared: Mapping[str, Any], path: Path) -> tuple[MultiAxisTable, float]:
        """The table at rest, without errors, and how long it is watched [s]."""
        named, where = _entries(table, path), f"{path}: {NAME}"
        if table.profile is not None:
            raise InputError(f"{path}: [profile] moves a [table]; [axes] are commanded by a [task]")
        gimbals = _gimbals(named, where)
        plant = MultiAxisTable(
            gimbals=gimbals,
            errors=np.zeros(len(gimbals.names)),
            max_rate=positive(named.max_rate, "rate", f"{where}.max_rate"),
            max_acceleration=positive(named.max_acceleration, "angular acceleration", f"{where}.max_acceleration"),
            **shared,
        )
        return plant, positive(table.duration, "time", f"{path}: duration")

    def spread(self, table: ScenarioTable, path: Path) -> AxesSpread:
        """The deviations of the table's errors."""
        return AxesSpread(_gimbals(_entries(table, path), f"{path}: {NAME}").sd)


#: What `insenv.core.system.System.plants` names.
MAKER = AxesMaker()


def _entries(table: ScenarioTable, path: Path) -> AxesTable:
    found: AxesTable = convert(table.carriers[NAME], AxesTable, (NAME,), path, "scenario")
    return found


def _gimbals(named: AxesTable, where: str) -> Gimbals:
    order = named.order
    apart = all(a != b for a, b in zip(order[:-1], order[1:], strict=True))
    if len(order) not in (2, 3) or set(order) - set("xyz") or not apart:
        raise InputError(
            f"{where}.order = {order!r}; wanted two or three of the letters x, y and z, outer axis first, such as 'xz'"
        )
    k = len(order)

    def error(name: str) -> float:
        sd = not_negative(getattr(named, name), "angle", f"{where}.{name}", 0.0)
        if sd > MOST_ERROR:
            raise InputError(f"{where}.{name} = {getattr(named, name)!r}; wanted a small angle, 1 deg at most")
        return sd

    sd = (
        *3 * (error("mounting"),),
        *2 * (error("tilt"),),
        error("heading_error"),
        *(k - 1) * (error("non_orthogonality"),),
        *2 * k * (error("eccentricity"),),
    )
    most = named.most if named.most is not None else k * ["360 deg"]
    if len(most) != k:
        raise InputError(f"{where}.most has {len(most)} angles; wanted one for each of the {k} axes")
    return Gimbals(
        axes=order,
        heading=given(named.heading, "angle", f"{where}.heading", 0.0),
        sd=sd,
        most=tuple(positive(text, "angle", f"{where}.most[{m}]") for m, text in enumerate(most)),
        noise=not_negative(named.encoder_noise, "angle", f"{where}.encoder_noise", 0.0),
        longest=positive(named.longest_dwell, "time", f"{where}.longest_dwell", 300.0),
    )
