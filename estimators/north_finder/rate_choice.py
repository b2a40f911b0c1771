"""The table rate and the directions that tell most of north, for the instrument at hand.

For each rate, plan and tilt `insenv.information.north` tells the least standard deviation of the azimuth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimators.common.rate_policies import Clockwork
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Mounting
from insenv.core.units import ARCSEC, DEG
from insenv.information.north import north_sd
from insenv.information.table_motion import Course, back_and_forth

#: Rates that are tried [rad/s], as far as the table has them.
RATES = tuple(rate * DEG for rate in (2, 3, 5, 7.5, 10, 15, 20, 30, 45, 60, 100))
#: Reversals that are tried: none, one (both ways), three.
REVERSALS = (0, 1, 3)


@dataclass(frozen=True)
class TableRun:
    """One way to run the table.

    Attributes
    ----------
    rate, tilt : float
        [rad/s], [rad]
    reversals : int
        0: one direction.
    sd : float
        Least standard deviation of the azimuth, root mean square over azimuths [rad]; infinite where nothing is told.
    """

    rate: float
    tilt: float
    reversals: int
    sd: float

    def __str__(self) -> str:
        ways = {0: "one way", 1: "both ways"}.get(self.reversals, f"{self.reversals} reversals")
        return f"{self.rate / DEG:g} deg/s, tilt {self.tilt / DEG:g} deg, {ways}: {self.sd / ARCSEC:.2f} arcsec"


@dataclass(frozen=True)
class ChosenRun:
    """The best candidate with its course, and all of them, best first."""

    best: TableRun
    course: Course
    candidates: tuple[TableRun, ...]

    @property
    def rate(self) -> float:
        """Table rate [rad/s]."""
        return self.best.rate

    @property
    def tilt(self) -> float:
        """Of the input axis above the table plane [rad]."""
        return self.best.tilt

    @property
    def reversals(self) -> int:
        """Of the table."""
        return self.best.reversals

    @property
    def sd(self) -> float:
        """Expected standard deviation of the azimuth [rad]."""
        return self.best.sd


class RateChoice(Clockwork):
    """A policy that follows the best plan at the tilt that the instrument is mounted with.

    Parameters
    ----------
    datasheet : Datasheet
    rates : sequence of float
        That are tried [rad/s].
    reversals : sequence of int
        Numbers of reversals that are tried.

    Raises
    ------
    InputError
        As `plan`.
    """

    def __init__(
        self, datasheet: Datasheet, rates: Sequence[float] = RATES, reversals: Sequence[int] = REVERSALS
    ) -> None:
        self.plan = plan(datasheet, rates=rates, reversals=reversals)
        super().__init__(self.plan.course, datasheet.duration, datasheet.sampling)


def plan(
    datasheet: Datasheet,
    tilts: Sequence[float] | None = None,
    rates: Sequence[float] = RATES,
    reversals: Sequence[int] = REVERSALS,
) -> ChosenRun:
    """Compare all candidates.

    Parameters
    ----------
    datasheet : Datasheet
    tilts : sequence of float, optional
        At which the instrument may be mounted [rad]; default: as it is.
    rates, reversals : sequences
        As of `RateChoice`.

    Raises
    ------
    InputError
        Without a latitude or a finite duration, or if the table has none of the rates.
    """
    if datasheet.site.latitude is None or not 0 < datasheet.duration < np.inf:
        raise InputError("rate_choice: the datasheet has no latitude or no finite duration; wanted both")
    able = [rate for rate in rates if 0 < abs(rate) <= datasheet.limits.rate * (1 + 1e-9)]
    if not able or not reversals:
        raise InputError(
            f"rate_choice: the table reaches {datasheet.limits.rate / DEG:g} deg/s and has none of the rates; "
            "wanted at least one rate and one number of reversals"
        )
    found = []
    for tilt in (datasheet.mounting.tilt,) if tilts is None else tilts:
        mounted = replace(datasheet, mounting=Mounting(tilt, datasheet.mounting.axes))
        found += [TableRun(w, tilt, r, expected_sd(mounted, w, r)) for w in able for r in reversals]
    # Of equal candidates (nothing is told by any) the first that was asked for.
    ranked = tuple(sorted(found, key=lambda candidate: candidate.sd))
    return ChosenRun(ranked[0], _course(datasheet, ranked[0].rate, ranked[0].reversals), ranked)


def expected_sd(datasheet: Datasheet, rate: float, reversals: int = 0, degree: int = 2) -> float:
    """Least standard deviation of the azimuth [rad], as the datasheet is mounted.

    Parameters
    ----------
    datasheet : Datasheet
    rate : float
        [rad/s]
    reversals : int
    degree : int
        Of the scale factor's polynomial.
    """
    return north_sd(datasheet, _course(datasheet, rate, reversals), datasheet.duration, degree)


def _course(datasheet: Datasheet, rate: float, reversals: int) -> Course:
    return back_and_forth(rate, datasheet.duration, reversals, datasheet.limits.acceleration)
