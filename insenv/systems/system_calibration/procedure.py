r"""The calibration of a unit: which positions, in which order, and how long at each.

What is made small is the largest ratio of a parameter's deviation to that after the published 19 positions in the
scenario's duration: one, all of the unit is told as well as by these. A unit of which a table cannot show the 19
positions is compared with the greedy sequence.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import ARCSEC
from insenv.design.kind import DesignedQuantity, Family, OfScenario, Plan, Variable
from insenv.design.texts import text
from insenv.information.positions import nineteen
from insenv.information.unit.directions import parameter_words, sentence, weak_directions
from insenv.information.unit.sequence import Planner, Visit, designed, even, greedy, parameter_of_table
from insenv.information.unit.sequence_bound import sequence_bound

#: Orders that are tried for a time.
TRIES = 150
#: An error of the table of which nobody tells, for what it would do [rad].
UNDECLARED = 1.0 * ARCSEC
#: Parameters that are named as what stands in the way, errors of the table that are named.
_NAMED = 3


@dataclass(frozen=True)
class SystemProcedure(OfScenario):
    """Free: positions, their order, and rests."""

    estimators: ClassVar[tuple[str, str]] = ("", "")
    axis: ClassVar[tuple[str, str]] = ("outer axis", "deg")

    @property
    def quantity(self) -> DesignedQuantity:
        """The largest ratio."""
        return DesignedQuantity("largest deviation", "times that of the 19 positions", 1.0)

    @cached_property
    def planner(self) -> Planner:
        """Of the scenario."""
        return Planner(self.sheet)

    @cached_property
    def _units(self) -> int:
        return sum(not parameter_of_table(q.name) for q in self.planner.model.parameters)

    @cached_property
    def _published(self) -> tuple[tuple[Visit, ...], str]:
        time = self.scenario.duration
        try:
            return even(self.planner, nineteen(self.planner.model.gimbals), time), "the 19 published positions"
        except InputError:
            return greedy(self.planner, time), "the greedy sequence"

    @cached_property
    def wanted(self) -> Floats:
        """Of each parameter of the unit, as a share of its prior deviation."""
        return self.planner.deviations(self._published[0], self.scenario.duration)[: self._units]

    def families(self) -> tuple[Family, ...]:
        """Nothing that a number says: the search is by order."""
        return ((Variable("tries", TRIES, TRIES, whole=True),),)

    def plan(self, values: Mapping[str, float], time: float) -> Plan | None:
        """The sequence of a time; None where there is none that the table can play."""
        if time not in self._found:
            visits = designed(self.planner, time, self.wanted, round(values["tries"]))
            self._found[time] = visits if abs(self.planner.time(visits) - time) < self.step else None
        found = self._found[time]
        return None if found is None else self._as_plan(found, time, _words(found), values)

    @cached_property
    def _found(self) -> dict[float, tuple[Visit, ...] | None]:
        return {}

    def published(self) -> Plan:
        """The 19 positions in the scenario's duration."""
        visits, words = self._published
        return self._as_plan(visits, self.scenario.duration, words, {})

    def _as_plan(self, visits: tuple[Visit, ...], time: float, words: str, values: Mapping[str, float]) -> Plan:
        course = tuple((visit.angles[0], visit.dwell) for visit in visits)
        changes: dict[str, Any] = {"duration": text(time, "s", 12)}
        plan = Plan(time, course, changes, words, dict(values))
        self._visits[plan.words] = visits
        return plan

    @cached_property
    def _visits(self) -> dict[str, tuple[Visit, ...]]:
        return {}

    def sd(self, plan: Plan) -> float:
        """The largest ratio, by the full model."""
        told = self.planner.deviations(self._visits[plan.words], plan.time)[: self._units]
        return float(np.max(told / self.wanted))

    def remarks(self) -> tuple[str, ...]:
        """What no sequence betters, what the published one does not tell, and what the table may feign."""
        gimbals, names = self.planner.model.gimbals, [q.name for q in self.planner.model.parameters]
        bound = sequence_bound(self.sheet)
        least = bound.time(self.wanted, 2 * self.scenario.duration)
        order = np.argsort(-bound.ratio(max(least, self.step), self.wanted).weights)[:_NAMED]
        hard = ", ".join(parameter_words(names[i], gimbals) for i in order)
        said = [
            f"no sequence of right angles tells all as well in less than {least:.0f} s (bound: white noise alone, and "
            f"any order); what takes the time: {hard}"
        ]
        matrix = self.planner.quick(self._published[0])
        said += [f"{self._published[1]}: {sentence(one, gimbals)}" for one in weak_directions(matrix, names)]
        return (*said, *self._feigned())

    def _feigned(self) -> tuple[str, ...]:
        """What errors of the table that the scenario does not declare would do, those that do most first."""
        table = self.planner.model.gimbals
        missing = [j for j, sd in enumerate(table.sd) if not sd > 0]
        if not missing:
            return ()
        sd = tuple(sd if sd > 0 else UNDECLARED for sd in table.sd)
        sheet = replace(self.sheet, mounting=replace(self.sheet.mounting, gimbals=replace(table, sd=sd)))
        wide = Planner(sheet)
        matrix = wide.quick(self._published[0])
        names = [q.name for q in wide.model.parameters]
        new = [names.index(table.names[j]) for j in missing]
        old = [i for i in range(len(names)) if i not in new]
        cov: Floats = np.asarray(np.linalg.inv(np.eye(len(old)) + matrix[np.ix_(old, old)]), float)
        moved = np.abs(cov @ matrix[np.ix_(old, new)]) / np.sqrt(np.diag(cov))[:, None]
        moved = moved[: self._units]
        order = np.argsort(-moved.max(axis=0))[:_NAMED]
        return tuple(
            f"1 arcsec of {parameter_words(names[new[k]], table)}, which is not declared, moves "
            f"{parameter_words(names[old[int(np.argmax(moved[:, k]))]], table)} by {moved[:, k].max():.2g} of its "
            "deviation"
            for k in order
        )

    def possible(self) -> tuple[Mapping[str, Any], ...]:
        """None: what the table may feign is said in `remarks`."""
        return ()


def _words(visits: tuple[Visit, ...]) -> str:
    """Positions in degrees with the rest at each, in order."""
    return "; ".join(
        f"{' '.join(f'{np.degrees(a) + 0.0:.0f}' for a in visit.angles)}: {visit.dwell:.0f} s" for visit in visits
    )
