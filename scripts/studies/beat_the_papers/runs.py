"""Published procedures and better ones as points of time against accuracy, each played in its environment.

The accuracy is the root mean square of true errors; beside it the root mean square of z-scores, which is 1 where the
estimator tells true deviations. Bounds are those of Cramér and Rao for the same motion.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import studies.rate_table.policies as tables
import studies.two_position.runs as vehicle
from studies.north_finder.runs import Makers, errors
from studies.north_finder.runs import Procedure as Turning
from studies.rate_table.policy_runs import HEIGHT, WIDTH, Maker, random_faults
from studies.two_position.tables import published_rest

from estimators.common.rate_policies import ConstantRate
from estimators.north_finder.gls import NorthGls
from estimators.north_finder.rate_choice import RateChoice, plan
from estimators.north_finder.revolution import Revolution
from estimators.rate_table.rate_ladder import EMPTY, Ladder
from estimators.two_position.alignment_told import Told
from estimators.two_position.transposition import instrument, turn_time
from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.core.units import ARCMIN, ARCSEC, DEG, PPM
from insenv.design.designing import Asked, Designed, design, kind_of
from insenv.design.front import Designer
from insenv.design.played import PlayStage
from insenv.design.written import write_scenario
from insenv.information.alignment import bound, procedure
from insenv.systems.north_finder.env import north_finder
from insenv.systems.two_position.env import two_position

VEHICLE, TABLE, LADDER = "two_position/published_a2", "north_finder/realistic", "rate_table/b215"
PUBLISHED, DOCUMENTED, DESIGNED = "published", "documented", "designed"
#: Runs of a design's own proof: what it finds is played here.
_TWO = range(2)
#: Demanded of the inertial part: 3 sigma below one minute of arc [arcmin].
DEMANDED = 1 / 3


@dataclass(frozen=True)
class Point:
    """A procedure with its estimator, played.

    Attributes
    ----------
    kind : str
        "published", "documented" or "designed".
    procedure, estimator : str
    time : float
        [s]
    rms, told, z : float
        Root mean squares of the errors, of the deviations that the estimator tells, and of z-scores.
    runs : int
    found, false : float
        Share of the runs in which a fault was found, and of those without one in which one was; NaN: none is sought.
    """

    kind: str
    procedure: str
    estimator: str
    time: float
    rms: float
    told: float
    z: float
    runs: int
    found: float = np.nan
    false: float = np.nan


@dataclass(frozen=True)
class Panel:
    """One system: points of its table, further points by kind, predictions by label, and errors that are demanded."""

    title: str
    quantity: str
    asked: tuple[Point, ...]
    series: dict[str, tuple[Point, ...]]
    predicted: dict[str, tuple[Floats, Floats]]
    demanded: tuple[float, ...]


# --------------------------------------------------------------------------------------------------- two positions


def two_positions(seeds: Sequence[int], jobs: int) -> Panel:
    """Time until 3 sigma < 1 arcmin of the inertial part, noise A2; around it the error at other times."""
    rest = published_rest(VEHICLE)
    few = seeds[: max(4, len(seeds) // 2)]
    asked = (
        _schedule(300.0, seeds),
        _schedule(rest, seeds),
        _stopping("covariance_triggered", "two_position_tied", DEMANDED, np.pi, seeds),
        _stopping("three_rests", "two_position_joint", DEMANDED, 0.0, seeds),
        *_designed_vehicle(seeds, jobs),
    )
    series = {
        PUBLISHED: tuple(_schedule(each, few) for each in (120.0, 200.0, 500.0)),
        DOCUMENTED: tuple(
            _stopping("three_rests", "two_position_joint", each * DEMANDED, 0.0, few) for each in (0.5, 0.7, 1.5, 2.5)
        ),
    }
    words = ("Two positions: 3 sigma < 1 arcmin", "inertial part, rms [arcmin]")
    return Panel(*words, asked, series, _predicted_of_rests(), (DEMANDED,))


def _schedule(rest: float, seeds: Sequence[int]) -> Point:
    changes = (("duration", f"{2 * rest + 20:.0f} s"),)
    case = vehicle.Procedure(VEHICLE, settings=(("rest", float(rest)),), changes=changes)
    words = f"{rest:.0f} s, 170 deg, {rest:.0f} s"
    return _of_heading(PUBLISHED, words, "two_position", vehicle.judge(case, "two_position", seeds))


def _stopping(policy: str, estimator: str, demanded: float, turned: float, seeds: Sequence[int]) -> Point:
    case = vehicle.Procedure(
        VEHICLE, policy, (("demanded", demanded * ARCMIN),), (("duration", "2000 s"),), turned=turned
    )
    return _of_heading(DOCUMENTED, f"`{policy}`", estimator, vehicle.judge(case, estimator, seeds))


def _of_heading(kind: str, words: str, estimator: str, one: vehicle.Judged) -> Point:
    told = float(np.sqrt(np.mean(one.sd["heading"] ** 2)) / ARCMIN)
    time, rms = float(one.time.mean()), one.rms("heading")
    return Point(kind, words, estimator, time, rms, told, one.z("heading"), len(one.time))


def _predicted_of_rests() -> dict[str, tuple[Floats, Floats]]:
    """Two equal rests at 170 deg, and three with half turns there and back."""
    sheet = two_position(VEHICLE).datasheet
    told = instrument(Told.of(sheet))
    spent = np.geomspace(120.0, 1000.0, 12)
    found = {}
    for label, turns in (
        ("predicted, two equal rests", [170 * DEG]),
        ("predicted, three equal rests", [180 * DEG, 180 * DEG]),
    ):
        turning = turn_time(sheet, turns[0])
        rests = (spent - len(turns) * turning) / (len(turns) + 1)
        sd = [bound(told, procedure(float(rest), turns, turning)).installation / ARCMIN for rest in rests]
        found[label] = (spent, np.array(sd))
    return found


def _designed_vehicle(seeds: Sequence[int], jobs: int) -> tuple[Point, ...]:
    """What `insenv design` finds for the same demand."""
    with tempfile.TemporaryDirectory() as folder:
        changes = {"design": {"quantity": "heading", "demanded": f"{DEMANDED:.9g} arcmin"}}
        path = write_scenario(VEHICLE, changes, "The inertial part alone.", Path(folder) / "asked.toml")
        return _designed(design(path, seeds=_TWO, jobs=jobs), ARCMIN, seeds, jobs)


def _designed(found: Designed, unit: float, seeds: Sequence[int], jobs: int) -> tuple[Point, ...]:
    """The designed procedure alone, on as many runs as the others."""
    some, plan = range(seeds[0], seeds[0] + len(seeds)), found.chosen.plan
    stage = PlayStage(found.scenario, found.quantity, jobs)
    check = stage.check(DESIGNED, plan, found.checks[0].estimator, some, found.chosen.sd)
    s = check.score
    words = found.chosen.plan.words
    return (
        Point(DESIGNED, words, check.estimator, check.time, s.rms[0] / unit, s.told / unit, s.spread[0], check.runs),
    )


# ---------------------------------------------------------------------------------------------------- north finder


def north(seeds: Sequence[int], jobs: int) -> Panel:
    """Error of north in 300 s, and at other times, with the realistic instrument."""
    few = seeds[: max(4, len(seeds) // 2)]
    asked = (*_turning(300.0, seeds), *_designed_north("300 s", seeds, jobs), *_designed_north("150 s", seeds, jobs))
    several = [_turning(time, few) for time in (100.0, 150.0, 200.0, 450.0)]
    series = {PUBLISHED: tuple(one[0] for one in several), DOCUMENTED: tuple(one[1] for one in several)}
    return Panel(
        "North, realistic instrument", "azimuth, rms [arcsec]", asked, series, _predicted_of_turns(), (46.0, 30.0)
    )


def _turning(time: float, seeds: Sequence[int]) -> tuple[Point, Point]:
    """The published procedure, and `rate_choice` at the tilt that it likes best."""
    lasting: dict[str, Any] = {"duration": f"{time:g} s"}
    best = plan(north_finder(TABLE, lasting).datasheet, tilts=[tilt * DEG for tilt in (5, 10, 12, 15, 20, 30)])
    mounted = lasting | {"table.tilt": f"{best.tilt / DEG:g} deg"}
    words = (
        f"{best.rate / DEG:g} deg/s, {'both ways' if best.best.reversals else 'one way'}, tilt {best.tilt / DEG:g} deg"
    )
    steady = partial(ConstantRate, rate=10 * DEG)
    return (
        _of_north(PUBLISHED, "10 deg/s one way, tilt 30 deg", steady, Revolution, lasting, seeds),
        _of_north(DOCUMENTED, f"`rate_choice`: {words}", RateChoice, NorthGls, mounted, seeds),
    )


def _of_north(kind: str, words: str, policy: Any, make: Any, changes: dict[str, Any], seeds: Sequence[int]) -> Point:
    name = {Revolution: "revolution", NorthGls: "north_gls"}[make]
    makers: Makers = {name: make}
    one = errors(Turning(TABLE, policy, changes), makers, seeds)[name]
    z = float(np.sqrt(np.mean((one.azimuth / one.sd) ** 2)))
    time = float(changes["duration"].removesuffix(" s"))
    return Point(kind, words, name, time, one.rms, one.told, z, len(seeds))


def _designed_north(time: str, seeds: Sequence[int], jobs: int) -> tuple[Point, ...]:
    return _designed(design(TABLE, Asked(time=time), _TWO, jobs), ARCSEC, seeds, jobs)


def _predicted_of_turns() -> dict[str, tuple[Floats, Floats]]:
    """What `insenv design` predicts of the best procedure that it finds."""
    kind, _ = kind_of(TABLE)
    times = np.array([80.0, 110.0, 150.0, 200.0, 300.0, 450.0])
    designer = Designer(kind)
    best = [designer.at(time) for time in times[::-1].tolist()][::-1]
    return {"predicted, best design": (times, np.array([np.nan if p is None else p.sd / ARCSEC for p in best]))}


# ------------------------------------------------------------------------------------------------------ rate table


def rate_table(seeds: Sequence[int], jobs: int) -> Panel:
    """Error of the scale factor and whether a fault at an unknown rate is found, B-215."""
    del jobs
    n = len(seeds)
    rows = {name: _ladder(name, f"`{name}`", n) for name in tables.POLICIES}
    asked = (rows["published_ladder"], rows["sweep_and_refine"], _designed_ladder(n))
    others = tuple(row for name, row in rows.items() if name not in ("published_ladder", "sweep_and_refine"))
    words = ("Scale factor, a fault at an unknown rate", "scale factor, rms [ppm]")
    return Panel(*words, asked, {DOCUMENTED: others}, _least_of_a_line(), (asked[0].rms,))


def _ladder(name: str, words: str, n: int, maker: Maker | None = None) -> Point:
    row = tables.study(name, random_faults(n), random_faults(n, 2, height=0.0), maker)
    rms, told = row.scale_factor_rms / PPM, row.scale_factor_sd / PPM
    kind = {"published_ladder": PUBLISHED, DESIGNED: DESIGNED}.get(name, DOCUMENTED)
    return Point(kind, words, "least squares", row.time, rms, told, rms / told, row.runs, row.found, row.false_alarms)


def _designed_ladder(n: int) -> Point:
    """What `insenv design` finds for the deviation of the published list, the fault's height and width told to it."""
    fault = {"height": f"{HEIGHT / DEG:.9g} deg/s", "width": f"{WIDTH / DEG:.9g} deg/s"}
    with tempfile.TemporaryDirectory() as folder:
        kind, _ = kind_of(LADDER)
        demanded = f"{kind.sd(kind.published()) / PPM:.6g} ppm"
        changes = {"design": {"demanded": demanded, "fault": fault}}
        path = write_scenario(LADDER, changes, "The deviation of the published list.", Path(folder) / "asked.toml")
        plan = design(path, seeds=range(0)).chosen.plan
    time, rate = np.array(plan.course).T

    def maker(sheet: Datasheet) -> Ladder:
        settling = np.abs(np.diff(rate, prepend=0.0)) / sheet.limits.acceleration
        return Ladder(sheet, EMPTY.append(rate, time - settling))

    return _ladder(DESIGNED, plan.words, n, maker)


def _least_of_a_line() -> dict[str, tuple[Floats, Floats]]:
    """Half of the time at each end of the range, white noise alone: a line has no smaller variance."""
    times, noise = np.geomspace(300.0, 6000.0, 12), 0.12 * DEG / 60
    return {"least of a line, white noise": (times, noise / (35 * DEG) / np.sqrt(times) / PPM)}
