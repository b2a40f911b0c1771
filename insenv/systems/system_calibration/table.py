"""``[axes]`` of a scenario: a table of two or three axes, and what is drawn of its errors in every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.unit.gimbals import Gimbals
from insenv.data.manifest.gimbals import gimbals
from insenv.data.manifest.schema import GimbalsTable, convert
from insenv.scenario.draws import PLACE, generator
from insenv.scenario.schema import ScenarioTable
from insenv.scenario.values import positive
from insenv.systems.system_calibration.plant import MultiAxisTable

#: Name of the table in a scenario.
NAME = "axes"
#: Place of the draw of the table's errors.
ERRORS = PLACE + 110


class AxesTable(GimbalsTable, kw_only=True):
    """``[axes]``: the axes and deviations of their errors (`insenv.data.manifest.gimbals`), and their limits.

    The errors are drawn for every run, and told.
    """

    max_rate: str
    max_acceleration: str
    most: list[str] | None = None
    longest_dwell: str | None = None


@dataclass(frozen=True)
class AxesSpread:
    """The table's errors, drawn with their deviations."""

    sd: tuple[float, ...]

    @property
    def sight_and_level(self) -> tuple[None, tuple[float, float]]:
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
    """Makes the plant of ``[axes]``; see `insenv.scenario.plant.PlantMaker`."""

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
    found, k = gimbals(named, where), len(named.order)
    most = named.most if named.most is not None else k * ["360 deg"]
    if len(most) != k:
        raise InputError(f"{where}.most has {len(most)} angles; wanted one for each of the {k} axes")
    return replace(
        found,
        most=tuple(positive(text, "angle", f"{where}.most[{m}]") for m, text in enumerate(most)),
        longest=positive(named.longest_dwell, "time", f"{where}.longest_dwell", 300.0),
    )
