r"""The north finder: at which rate a table turns, how often it turns over, and how the gyro is tilted.

sigma is that of `insenv.information.north`. Of n reversals all n + 1 stretches of steady turning are equally long. A
level error of the table that no accelerometer tells moves north by tan(latitude) of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from insenv.core.recording import Mounting
from insenv.core.units import DEG
from insenv.design import table
from insenv.design.kind import Course, DesignedQuantity, Family, OfScenario, Plan, Variable
from insenv.design.texts import rounded, text
from insenv.effects.angle import AngleLockedRate, EncoderHarmonic
from insenv.effects.bias import BiasDrift
from insenv.effects.rate.scale import ScaleFactorDrift
from insenv.information.north import north_sd
from insenv.information.rate_noise import lock_in
from insenv.information.table_motion import back_and_forth
from insenv.plants.turntable import Turntable
from insenv.scenario.turntable import TableSpread

#: What is free where nobody says [rad/s], [rad].
RATES, TILTS, REVERSALS = (2 * DEG, np.inf), (5 * DEG, 60 * DEG), (1, 4)
#: The published procedure: one rate in one direction.
PUBLISHED_RATE = 10 * DEG
#: Rates and tilts are told to these steps [deg/s], [deg].
_RATE_STEP, _TILT_STEP = 0.1, 0.5
#: The input must be so many times the lock-in threshold: below, the laws of it do not hold.
_AWAY_FROM_LOCK = 4.0


@dataclass(frozen=True)
class NorthFinderProcedure(OfScenario):
    """Free: rate, reversals, tilt."""

    estimators: ClassVar[tuple[str, str]] = ("north_gls", "revolution")
    axis: ClassVar[tuple[str, str]] = ("table rate", "deg/s")

    @property
    def quantity(self) -> DesignedQuantity:
        """The azimuth."""
        return DesignedQuantity("azimuth", "rad", self.free.demanded, circular=True)

    def families(self) -> tuple[Family, ...]:
        """One: all is searched together."""
        limit = self.sheet.limits.rate
        slow, fast = self.free.between("rates", "rate", RATES, (0.0, limit))
        flat, steep = self.free.between("tilt", "angle", TILTS, (0.0, np.pi / 2))
        few, many = self.free.whole("reversals", REVERSALS, 0)
        return (
            (
                Variable("rate", slow, min(fast, limit), "deg/s", points=9, log=True),
                Variable("tilt", flat, steep, "deg", points=7),
                Variable("reversals", few, many, whole=True),
            ),
        )

    def plan(self, values: Mapping[str, float], time: float) -> Plan | None:
        """Turning back and forth; None where the table has no time to turn over."""
        rate, tilt = rounded(values["rate"], "deg/s", _RATE_STEP), rounded(values["tilt"], "deg", _TILT_STEP)
        limits, reversals = self.sheet.limits, round(values["reversals"])
        if rate > limits.rate * (1 + 1e-9) or not 0 <= tilt < np.pi / 2:
            return None
        course = back_and_forth(rate, time, reversals, limits.acceleration)
        times = table.whole(np.diff([*course.at, time]), self.step, time)
        if min(times) < max(2 * rate / limits.acceleration, self.step):
            return None
        pieces = tuple(zip(times, course.rate, strict=True))
        ways = {0: "one way", 1: "both ways"}.get(reversals, f"{reversals} reversals")
        words = f"{text(rate, 'deg/s', 6)}, {ways}, tilt {text(tilt, 'deg', 6)}"
        changes = self._changes(pieces) | {"table.tilt": text(tilt, "deg")}
        return Plan(time, pieces, changes, words, dict(values))

    def published(self) -> Plan:
        """The scenario's profile, or one rate in one direction (Zhang, Wu, Wu, 2011), for its duration."""
        plant = self.scenario.rig.plant
        assert isinstance(plant, Turntable)
        course = table.scenario_course(self.scenario, plant.profile)
        words = "the scenario's own"
        if course is None:
            rate = min(PUBLISHED_RATE, self.sheet.limits.rate)
            course, words = ((self.scenario.duration, rate),), f"{text(rate, 'deg/s', 6)}, one way (published)"
        return Plan(table.length(course), course, self._changes(course), words)

    def sd(self, plan: Plan) -> float:
        """Of the azimuth, root mean square over azimuths [rad]."""
        sheet = self.sheet
        if (tilt := plan.changes.get("table.tilt")) is not None:
            sheet = replace(sheet, mounting=Mounting(self.free.quantity(tilt, "angle"), sheet.mounting.axes))
        slowest = min((abs(rate) for _, rate in plan.course if rate), default=0.0)
        if slowest * np.sin(sheet.mounting.tilt) < _AWAY_FROM_LOCK * lock_in(sheet) ** 0.5:
            return float(np.inf)
        return float(np.hypot(north_sd(sheet, table.rates(plan.course), plan.time), self._level))

    def remarks(self) -> tuple[str, ...]:
        """None."""
        return ()

    def possible(self) -> tuple[Mapping[str, Any], ...]:
        """An eccentric encoder, an error that is fixed to the table, a drifting bias and scale factor."""
        return (
            {"effect": EncoderHarmonic(1).key, "c": "0.1 arcsec", "s": "0 arcsec"},
            {"effect": EncoderHarmonic(2).key, "c": "0.1 arcsec", "s": "0 arcsec"},
            {"effect": AngleLockedRate(1).key, "c": "1e-4 deg/h", "s": "0 deg/h"},
            {"effect": BiasDrift.id, "c": "0.01 deg/h/h"},
            {"effect": ScaleFactorDrift.id, "c": "10 ppm/h"},
        )

    @property
    def _level(self) -> float:
        """What a level error does that nothing tells of [rad]."""
        if self.scenario.table.instrument.accel is not None:
            return 0.0
        latitude, spread = self.sheet.site.latitude or 0.0, self.scenario.spread
        assert isinstance(spread, TableSpread)
        return float(abs(np.tan(latitude)) * spread.level_sd[1])

    def _changes(self, course: Course) -> dict[str, Any]:
        return {"duration": text(table.length(course), "s", 12), "profile": table.profile(course)}
