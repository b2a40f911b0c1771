r"""The rate table: at which rates a gyro is run, how long, and how often the ends of the range are visited.

A procedure sweeps from the largest rate to its opposite at every second magnitude u_k = k s and back at those in
between, each magnitude both ways, and spends the rest of its time at both ends in turn, half of it before the sweep
and half after. So a steady drift falls out, and the sweep sees what a line's optimal design (both ends alone) never
looks for. With the means of dwells (`insenv.information.means`) and their variances v_j a fault of height h and width w
at c shows in dwell j with

    z_j(c) = h exp(-(|u_j| - c)^2 / (2 w^2)) / sqrt(v_j)

deviations, but for what a line takes of it. Wanted are two dwells, such as one each way, with z_j >= ``fault.sigma``,
at a share of all c.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import DEG, quantity_in
from insenv.design import table
from insenv.design.kind import Course, DesignedQuantity, Family, OfScenario, Plan, Variable
from insenv.design.texts import text
from insenv.effects.angle import AngleLockedRate
from insenv.effects.base import DrivenEffect
from insenv.effects.bias import BiasDrift
from insenv.effects.catalogue import by_key
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorAnomaly, ScaleFactorAsymmetry
from insenv.information.ladder_time import published
from insenv.information.means import Means, means, stated_noises
from insenv.information.scale_factor import declared, slope
from insenv.information.table_motion import motion
from insenv.plants.turntable import Turntable

#: What is free where nobody says: spacing of magnitudes as a share of the range, time at each [s], visits of the ends.
SPACINGS, DWELLS, VISITS = (1 / 150, 1 / 8), (2.0, 5.0), (1, 8)
#: A local fault that must not be missed where nobody says: height and width as shares of the range.
FAULT_HEIGHT, FAULT_WIDTH, SIGMA, SHARE = 1e-3, 1 / 160, 7.0, 0.99
#: Faults are looked for between these shares of the range; number of their places.
_BETWEEN, _PLACES = (1 / 35, 34.5 / 35), 400
#: A dwell begins where the table has settled; intervals of the motion, at most.
_INTERVALS = 5000


@dataclass(frozen=True)
class FaultToSee:
    """A local fault: height and width [rad/s], deviations that it must show with twice, share of its places."""

    height: float
    width: float
    sigma: float
    share: float


@dataclass(frozen=True)
class RateTableProcedure(OfScenario):
    """Free: spacing of the magnitudes, time at each, visits of the ends."""

    estimators: ClassVar[tuple[str, str]] = ("rate_line", "")
    axis: ClassVar[tuple[str, str]] = ("table rate", "deg/s")

    @property
    def quantity(self) -> DesignedQuantity:
        """The relative error of the scale factor."""
        return DesignedQuantity(ScaleFactor.id, "1", self.free.demanded)

    @cached_property
    def top(self) -> float:
        """Largest rate that is run [rad/s]."""
        assert self.scenario.task is not None
        widest = min(self.scenario.task.range, self.sheet.limits.rate)
        return self.free.between("rates", "rate", (0.0, widest), (0.0, self.sheet.limits.rate))[1]

    @cached_property
    def fault(self) -> FaultToSee:
        """What must not be missed.

        Raises
        ------
        InputError
            If a figure of ``design.fault`` has no meaning.
        """
        given, where = self.free.given.fault, self.free.where("fault")
        if given is None:
            return FaultToSee(FAULT_HEIGHT * self.top, FAULT_WIDTH * self.top, SIGMA, SHARE)
        height = quantity_in(given.height, "rad/s", f"{where}.height")
        width = quantity_in(given.width, "rad/s", f"{where}.width")
        if not (height > 0 and width > 0 and given.sigma >= 0 and 0 <= given.share <= 1):
            raise InputError(
                f"{where} has height {given.height!r}, width {given.width!r}, sigma {given.sigma:g} and share "
                f"{given.share:g}; wanted a height and a width above zero, and a share from 0 to 1"
            )
        return FaultToSee(height, width, given.sigma, given.share)

    def families(self) -> tuple[Family, ...]:
        """One."""
        fine, coarse = SPACINGS
        near, far = self.free.between("spacing", "rate", (fine * self.top, coarse * self.top), (1e-6, self.top))
        short, long = self.free.between("dwell", "time", DWELLS, (self.step, np.inf))
        few, many = self.free.whole("visits", VISITS, 0)
        return (
            (
                Variable("spacing", near, far, "deg/s", points=16, log=True),
                Variable("slots", np.ceil(short / self.step), np.ceil(long / self.step), whole=True),
                Variable("visits", few, many, whole=True),
            ),
        )

    def plan(self, values: Mapping[str, float], time: float) -> Plan | None:
        """Ends, sweep, ends; None where the time does not hold the sweep and a step for each visit."""
        count, visits = max(round(self.top / values["spacing"]), 2), round(values["visits"])
        u = self.top / count
        falling, rising = u * np.arange(count, -count - 1, -2), u * np.arange(1 - count, count, 2)
        rates = np.concatenate([falling, rising])
        settling = np.abs(np.diff(rates, prepend=self.top)) / self.sheet.limits.acceleration
        least = values["slots"] * self.step
        slots = np.ceil((settling + least) / self.step - 1e-9) * self.step
        left = time - float(slots.sum())
        # Both ends in turn, before and after: a pair each time, the same time in all of them.
        ends = np.array([self.top, -self.top] * visits)
        each = left / max(len(ends), 1)
        if left < 0 or (visits and each < least + 2 * self.top / self.sheet.limits.acceleration + self.step):
            return None
        half = (len(ends) + 1) // 2
        pieces = [*((each, r) for r in ends[:half][::-1]), *zip(slots, rates, strict=True)]
        pieces += [(each, r) for r in (ends[half:] if visits else ())]
        times = table.whole((float(t) for t, _ in pieces), self.step, time)
        course = _joined(tuple((t, float(r)) for t, (_, r) in zip(times, pieces, strict=True)))
        words = (
            f"{2 * count + 1} rates {text(u, 'deg/s', 4)} apart, {least:.4g} s each, "
            f"{2 * visits} times at the ends for {each:.4g} s"
        )
        covered = self._coverage(self._means(course))
        if covered < self.fault.share:
            return None
        return Plan(time, course, self._changes(course), words, dict(values), {"coverage": covered})

    def published(self) -> Plan:
        """The scenario's own profile, or the published list within the range: a turn of each rate (Zhang, 2016)."""
        plant = self.scenario.rig.plant
        assert isinstance(plant, Turntable)
        course, words = table.scenario_course(self.scenario, plant.profile), "the scenario's own"
        if course is None:
            course, words = self._list(), "a turn of each of the published rates"
        told = {"coverage": self._coverage(self._means(course))}
        return Plan(table.length(course), course, self._changes(course), words, {}, told)

    def _list(self) -> Course:
        listed = published()
        within = np.abs(listed.rate) <= self.top * (1 + 1e-9)
        rates, times = listed.rate[within], listed.time[within]
        settling = np.abs(np.diff(rates, prepend=0.0)) / self.sheet.limits.acceleration
        slots = np.ceil((times + settling) / self.step - 1e-9) * self.step
        return tuple(zip(slots.tolist(), rates.tolist(), strict=True))

    def sd(self, plan: Plan) -> float:
        """Of the relative error of the scale factor [1]."""
        cells = self._means(plan.course)
        if cells is None:
            return float(np.inf)
        told = declared(self.sheet, cells.motion)
        # What is known of the scale factor beforehand is no merit of a procedure.
        key = f"{ScaleFactor.id}.c"
        bound = cells.information.given(told.sd | {key: np.inf}).bound()
        weights, _ = slope(told, self.sheet, self.top)
        named = {name: weight for name, weight in weights.items() if weight and name in bound.names}
        g = np.array(list(named.values()))
        variance = float(g @ bound.block(tuple(named)) @ g)
        return float(np.sqrt(variance)) if np.isfinite(variance) and variance > 0 else float(np.inf)

    def remarks(self) -> tuple[str, ...]:
        """Of what is driven by chance."""
        driven = [d.effect for d in self.sheet.declared if isinstance(by_key(d.effect), DrivenEffect)]
        return (f"the bound knows nothing of {', '.join(driven)}",) if driven else ()

    def possible(self) -> tuple[Mapping[str, Any], ...]:
        """Senses that differ, a bend, a local fault at half of the range, a drifting bias."""
        return (
            {"effect": ScaleFactorAsymmetry.id, "c": "15 ppm"},
            {
                "effect": ScaleFactorAnomaly.id,
                "c": text(self.fault.height, "deg/s"),
                "u0": text(0.55 * self.top, "deg/s"),
                "s": text(self.fault.width, "deg/s"),
            },
            {"effect": BiasDrift.id, "c": "1 deg/h/h"},
            {"effect": AngleLockedRate(1).key, "c": "0.5 deg/h", "s": "0 deg/h"},
        )

    @cached_property
    def _known(self) -> dict[Course, Means | None]:
        """Means of the course that was looked at last: its coverage and its bound want the same."""
        return {}

    def _means(self, course: Course) -> Means | None:
        """The dwells at steady rates as means; None where there are too few."""
        if course not in self._known:
            self._known.clear()
            self._known[course] = self._averaged(course)
        return self._known[course]

    def _averaged(self, course: Course) -> Means | None:
        total, sheet = table.length(course), self.sheet
        n = round(total / self.step)
        parts = max(1, min(_INTERVALS // n, 2))
        exposure = motion(
            table.rates(course), np.linspace(0.0, total, n * parts + 1), sheet.mounting.tilt,
            sheet.site.latitude or 0.0, sheet.limits.acceleration,
        )  # fmt: skip
        edges, kept = self._cells(course, parts)
        if kept.sum() < 3:
            return None
        told = declared(sheet, exposure)
        per = max(round(total / (n * parts) * sheet.sampling), 1)
        return means(exposure, told.sensor, stated_noises(sheet, "gyro"), edges, kept, told.mean, per)

    def _cells(self, course: Course, parts: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Edges of the dwells in intervals, and which cells are dwells: what a table needs to settle is none."""
        starts = np.rint(np.cumsum([0.0, *(t for t, _ in course)]) / self.step).astype(int) * parts
        rates = np.array([0.0, *(rate for _, rate in course)])
        settling = np.abs(np.diff(rates)) / self.sheet.limits.acceleration
        lost = np.ceil(settling / (self.step / parts) - 1e-9).astype(int)
        # A settling of less than a tenth of an interval is a part of the dwell: the prediction averages it.
        lost[settling < 0.1 * self.step / parts] = 0
        edges, kept = [0], []
        for begin, end, gap in zip(starts[:-1], starts[1:], lost, strict=True):
            if gap > 0:
                edges.append(min(begin + gap, end))
                kept.append(False)
            if edges[-1] < end:
                edges.append(int(end))
                kept.append(True)
        return np.array(edges, np.int64), np.array(kept, bool)

    def _coverage(self, cells: Means | None) -> float:
        """Share of the places of a fault at which it would show in two dwells."""
        if cells is None:
            return 0.0
        share = cells.motion.projection
        rates = np.abs(cells.averaged(cells.motion.rate)) / share
        variance = np.diag(cells.covariance)
        centre = np.linspace(_BETWEEN[0] * self.top, _BETWEEN[1] * self.top, _PLACES)
        seen: Floats = self.fault.height * np.exp(-0.5 * ((rates[:, None] - centre) / self.fault.width) ** 2)
        second = np.sort(seen / np.sqrt(variance)[:, None], axis=0)[-2]
        return float(np.mean(second >= self.fault.sigma))

    def _changes(self, course: Course) -> dict[str, Any]:
        return {"duration": text(table.length(course), "s", 12), "profile": table.profile(course)}


@dataclass(frozen=True)
class ScaleFactorProcedure(RateTableProcedure):
    """The same of a task whose environment asks for nothing: the search alone."""

    estimators: ClassVar[tuple[str, str]] = ("", "")

    def remarks(self) -> tuple[str, ...]:
        """That nothing is played."""
        return ("the task asks for no quantity: nothing is played", *super().remarks())


def _joined(course: Course) -> Course:
    """Pieces of one rate that follow each other, as one."""
    found: list[tuple[float, float]] = []
    for time, rate in course:
        if found and abs(found[-1][1] - rate) < 1e-6 * DEG:
            found[-1] = (found[-1][0] + time, rate)
        else:
            found.append((time, rate))
    return tuple(found)
