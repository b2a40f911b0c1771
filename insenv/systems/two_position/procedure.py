r"""The two-position calibration: how often a parked vehicle turns, by which angles, and how long it rests.

sigma is that of `insenv.information.alignment`, the velocities of the turns left out; of the installation angle with
the sight's errors:

    sigma^2 = sigma_inertial^2 + sigma_orientation^2 + sigma_tracking^2 / readings

The heading at the start is the inertial part alone. A turn begins with a step of the task.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from insenv.core.errors import InputError
from insenv.core.units import ARCMIN, DEG
from insenv.design.kind import Course, DesignedQuantity, Family, OfScenario, Plan, Variable
from insenv.design.texts import rounded, text
from insenv.effects.bias import BiasDrift, BiasWarmUp
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.alignment import AlignedUnit, Stretch, instrument_of
from insenv.information.alignment_quick import installation_sd
from insenv.plants.vehicle import Vehicle

#: What is free where nobody says: turns, angles [rad], shortest and longest rest [s].
TURNS, ANGLES, REST = (1, 3), (30 * DEG, 180 * DEG), (5.0, np.inf)
#: The published procedure: rests [s] and turn [rad] (Guo, Li, He, 2018).
PUBLISHED = ((300.0, 170 * DEG),)
#: Quantities: of the whole angle, or of its inertial part, whose demand is the paper's, 3 sigma below 1 arcmin.
INSTALLATION, HEADING = "installation_angle", "heading"
DEMANDED_OF_HEADING = ARCMIN / 3
#: Angles are told to this step [deg].
_ANGLE_STEP = 5.0


@dataclass(frozen=True)
class TwoPositionProcedure(OfScenario):
    """Free: number, angles and senses of the turns, and how the time is shared by the rests."""

    estimators: ClassVar[tuple[str, str]] = ("two_position_joint", "two_position")
    axis: ClassVar[tuple[str, str]] = ("heading turned", "deg")

    @property
    def vehicle(self) -> Vehicle:
        """The plant."""
        plant = self.scenario.rig.plant
        assert isinstance(plant, Vehicle)
        return plant

    @property
    def quantity(self) -> DesignedQuantity:
        """The installation angle, or the heading at the start where ``design.quantity`` says so."""
        name = self.free.given.quantity or INSTALLATION
        if name not in (INSTALLATION, HEADING):
            wanted = f"wanted {INSTALLATION!r}, or {HEADING!r} for its inertial part"
            raise InputError(f"{self.free.where('quantity')} = {name!r}; {wanted}")
        demanded = self.free.demanded if name == INSTALLATION else DEMANDED_OF_HEADING
        return DesignedQuantity(name, "rad", demanded, circular=True)

    def families(self) -> tuple[Family, ...]:
        """For each number of turns: back and forth, which undoes what a gyro's scale factor adds, and then onward."""
        few, many = self.free.whole("turns", TURNS, 0)
        low, high = self.free.between("angles", "angle", ANGLES, (0.0, np.pi))
        found = []
        for turns in range(few, many + 1):
            angles = [Variable(f"angle_{k}", low, high, "deg", points=3) for k in range(turns)]
            shares = [Variable(f"share_{k}", 0.25, 4.0, points=3, log=True) for k in range(turns)]
            senses = (0.0, 1.0) if turns > 1 else (0.0,)
            found += [(*angles, *shares, Variable("onward", sense, sense, whole=True)) for sense in senses]
        return tuple(found)

    def plan(self, values: Mapping[str, float], time: float) -> Plan | None:
        """Rests, in the ratios of the shares (the last one's is 1), and turns; None where a rest would be too short."""
        turns = sum(name.startswith("angle") for name in values)
        sense = 1.0 if values["onward"] else -1.0
        angles = [sense**k * rounded(values[f"angle_{k}"], "deg", _ANGLE_STEP) for k in range(turns)]
        if 0.0 in angles:
            return None
        shares = np.array([*(values[f"share_{k}"] for k in range(turns)), 1.0])
        lasting = [self.vehicle.turn_time(angle) for angle in angles]
        spare = time - sum(lasting)
        shortest, longest = self.free.between("rest", "time", REST, (0.0, np.inf))
        rests, passed = [], 0.0
        for share, turning in zip(shares[:-1] / shares.sum(), lasting, strict=True):
            # A command goes out with a step; the turn before need not have ended with one.
            begin = np.ceil((passed + share * spare) / self.step - 0.5) * self.step
            rests.append(float(begin) - passed)
            passed = float(begin) + turning
        every = [*rests, time - passed]
        if min(every) < shortest or max(every) > longest:
            return None
        course = tuple(zip(rests, angles, strict=True))
        words = ", ".join([*(f"{text(r, 's', 4)}, {text(a, 'deg', 4)}" for r, a in course), f"{every[-1]:.4g} s"])
        return self._plan(time, course, words, values)

    def published(self) -> Plan:
        """The scenario's profile, or 300 s, 170 deg, 300 s."""
        table = self.scenario.table.profile
        course: Course = self.vehicle.profile if table is not None else PUBLISHED
        time, words = self.scenario.duration, "the scenario's own" if table is not None else "the published one"
        if table is None:
            time = np.ceil((2 * PUBLISHED[0][0] + self.vehicle.turn_time(PUBLISHED[0][1])) / self.step) * self.step
        rested = ", ".join(f"{text(r, 's', 4)}, {text(a, 'deg', 4)}" for r, a in course)
        return self._plan(float(time), course, f"{words}: {rested or 'at rest'}", {})

    def sd(self, plan: Plan) -> float:
        """Of the quantity [rad]."""
        inertial = installation_sd(self.instrument, self._stretches(plan), float(np.mean(self.vehicle.heading)))
        if self.quantity.name == HEADING:
            return inertial
        sight = self.sheet.sight
        assert sight is not None
        table = self.scenario.table.sight
        readings = 1 + len(plan.course) if table is not None and table.readings == "turns" else 1
        data = float(np.sqrt(inertial**2 + sight.orientation**2 + sight.tracking**2 / readings))
        return float((data**-2 + sight.installation**-2.0) ** -0.5)

    def remarks(self) -> tuple[str, ...]:
        """Of a vehicle that does not stand still."""
        if self.scenario.table.vehicle is None or self.scenario.table.vehicle.sway is None:
            return ()
        return ("the bound knows nothing of the vehicle's sway",)

    def possible(self) -> tuple[Mapping[str, Any], ...]:
        """A gyro that warms up, a drifting bias, scale factor and misalignment of what senses the turn."""
        return (
            {"effect": BiasWarmUp.id, "targets": "gyro_x", "c": "0.002 deg/h", "tau": "300 s"},
            {"effect": BiasDrift.id, "targets": "gyro_x", "c": "0.01 deg/h/h"},
            {"effect": ScaleFactor.id, "targets": "gyro_z", "c": "10 ppm"},
            {"effect": BiasDrift.id, "targets": "accel_x", "c": "10 ug/h"},
        )

    @cached_property
    def instrument(self) -> AlignedUnit:
        """As the bound takes it, of what the datasheet tells."""
        return instrument_of(self.sheet)

    def _stretches(self, plan: Plan) -> list[Stretch]:
        found, passed = [], 0.0
        for rest, angle in plan.course:
            turning = self.vehicle.turn_time(angle)
            found += [Stretch(rest), Stretch(turning, angle)]
            passed += rest + turning
        return [*found, Stretch(max(plan.time - passed, 0.0))]

    def _plan(self, time: float, course: Course, words: str, values: Mapping[str, float]) -> Plan:
        # Estimators tell the heading of the end; a turn counter-clockwise makes it smaller.
        moved = -sum(angle for _, angle in course) if self.quantity.name == HEADING else 0.0
        changes, track = self._changes(course, time), self._track(course, time)
        return Plan(time, course, changes, words, dict(values), moved=float(moved), track=track)

    def _track(self, course: Course, time: float) -> Course:
        """Angle that the vehicle has turned by, counter-clockwise."""
        points, passed, turned = [(0.0, 0.0)], 0.0, 0.0
        for rest, angle in course:
            passed += rest
            points.append((passed, turned))
            passed, turned = passed + self.vehicle.turn_time(angle), turned + angle
            points.append((passed, turned))
        return (*points, (time, turned))

    def _changes(self, course: Course, time: float) -> dict[str, Any]:
        turns = [[text(rest, "s", 12), text(angle, "deg")] for rest, angle in course]
        profile = {"kind": "turns", "turns": turns} if turns else {"kind": "rest"}
        return {"duration": text(time, "s", 12), "profile": profile}
