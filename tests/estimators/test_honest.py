r"""What estimators tell of themselves: the normalised error squared of all that they estimate, on what they play.

    NEES = mean of e' P^-1 e / q ~ chi^2(R q) / (R q),      z_j^2 = mean of e_j^2 / P_jj ~ chi^2(R) / R

over R runs that are drawn from the datasheet, with the true value of every quantity, not of the one alone that a task
asks for. Bounds are those of chi-square at `CHANCE` for each figure; errors that are not quite Gaussian (an azimuth of
which one direction is known better than another) have `ROOM` more.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from estimators.common.rate_policies import ConstantRate
from insenv.core.attitude import angles_from_dcm, dcm_from_angles
from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Estimate, Policy
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Floats
from insenv.core.units import DEG
from insenv.envs.rollout import RollOut, roll_out
from insenv.envs.task import Task
from insenv.evaluate.runs import task_of

#: Probability that an honest figure fails: of all 200 figures one in 1e4 times.
CHANCE = 5e-7
#: Share by which a mean square may be off besides.
ROOM = 0.08
RUNS = 64
ANGLES = ("azimuth", "installation_angle", "heading", "pitch", "roll")
#: Few samples in long steps: what an estimator tells is that of what it was given.
SLOW = {"instrument.sampling": "20 Hz", "task.step": "5 s"}
SLOW_LASER = {"instrument.sampling": "50 Hz", "task.step": "5 s"}
Truth = Callable[["Case", Task, RollOut], Mapping[str, Floats]]


@dataclass(frozen=True)
class Case:
    """A scenario that is played, and which estimators watch; ``turn``: of the vehicle or the table's rate."""

    scenario: str
    estimators: tuple[str, ...]
    truth: Truth
    policy: str = ""
    turn: float = 0.0
    changes: Mapping[str, Any] = field(default_factory=dict)
    #: Quantities that are not judged.
    without: tuple[str, ...] = ()
    runs: int = RUNS

    def player(self, task: Task) -> str | Policy:
        return self.policy or ConstantRate(task.datasheet, self.turn)


def vehicle(case: Case, task: Task, played: RollOut) -> Mapping[str, Floats]:
    """Attitude at the end of a turn counter-clockwise about the normal of the ground, and the biases."""
    true, slope = played.truth, task.world.scenario.rig.plant.slope.dcm  # type: ignore[attr-defined]
    c, s = np.cos(case.turn), np.sin(case.turn)
    turned = slope @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ slope.T
    attitude = angles_from_dcm(turned @ dcm_from_angles(true["heading"], true["pitch"], true["roll"]))
    biases = {f"{kind}_{axis}": true[f"{kind}_{axis}.bias.c"] for kind in ("gyro", "accel") for axis in "xyz"}
    named = dict(zip(("heading", "pitch", "roll"), attitude, strict=True))
    return {"installation_angle": true["installation_angle"], **named, **biases}


def north(case: Case, task: Task, played: RollOut) -> Mapping[str, Floats]:
    """The azimuth, and the scale factor at the end, of which a bias at one rate is a part."""
    true, sheet = played.truth, task.datasheet
    found = {"azimuth": true["azimuth"]}
    latitude, tilt = sheet.site.latitude, sheet.mounting.tilt
    if case.turn and "published" in case.scenario and latitude is not None:
        u = np.sin(tilt) * (case.turn + EARTH_RATE * np.sin(latitude))
        late = np.exp(-played.time / true["gyro.scale_factor_warm_up.tau"])
        warm = true["gyro.scale_factor_warm_up.c"] * late
        found["scale_factor"] = true["gyro.scale_factor.c"] + warm + true["gyro.bias.c"] / u
    return found


def table(case: Case, task: Task, played: RollOut) -> Mapping[str, Floats]:
    """The slope of the line, the bias, and the difference of the two senses."""
    true = played.truth
    nothing = np.zeros(len(played.seeds))
    asymmetry = 2 * np.abs(true.get("gyro.scale_factor_asymmetry.c", nothing))
    return {"scale_factor": true["scale_factor"], "bias": true["gyro.bias.c"], "asymmetry": asymmetry}


TWO = ("two_position", "two_position_tied", "two_position_joint")
TURN = 170 * DEG
LEANS = {"vehicle.pitch": "3 deg"}
SLOPE = {"vehicle.slope": "3 deg", "vehicle.slope_towards": "60 deg"}
#: Of what nobody can be told: the deflection of the vertical is the level's error.
REAL = {"vehicle.deflection": ["0 arcsec", "0 arcsec"]}
DECLARED = {"undeclared": {}, "duration": "4400 s", **SLOW}
LINES = ("rate_line", "rate_gls")
FAST = {"table.max_rate": "120 deg/s", **SLOW_LASER}
CASES = {
    **{
        f"vehicle {name}": Case(f"two_position/{name}", TWO, vehicle, "published_schedule", TURN, SLOW)
        for name in ("published_a", "published_a2", "published_b")
    },
    "vehicle leans": Case("two_position/published_a", TWO, vehicle, "published_schedule", TURN, SLOW | LEANS),
    "vehicle on a slope": Case("two_position/published_a", TWO, vehicle, "published_schedule", TURN, SLOW | SLOPE),
    # The published method takes a vehicle for still that sways: it says so. The roll sways to the last.
    "vehicle realistic": Case(
        "two_position/realistic", TWO[1:], vehicle, "published_schedule", TURN, SLOW | REAL, ("roll",)
    ),
    **{
        f"north at {rate} deg/s": Case(
            "north_finder/published",
            ("north_gls", "correlation", "revolution"),
            north,
            turn=rate * DEG,
            changes=FAST,
            # Of another time than the end.
            without=("scale_factor", "scale_factor_rate") if rate else (),
        )
        for rate in (3, 10, 60, 100)
    },
    "north realistic, slowly": Case("north_finder/realistic", ("north_gls",), north, turn=3 * DEG, changes=SLOW_LASER),
    "north realistic": Case(
        "north_finder/realistic", ("north_gls", "correlation"), north, turn=10 * DEG, changes=SLOW_LASER
    ),
    "north realistic, both ways": Case(
        "north_finder/realistic", ("north_gls",), north, "bidirectional", changes=SLOW_LASER
    ),
    "B-215": Case("rate_table/b215", LINES, table, "published_ladder", changes=DECLARED, runs=24),
    "KVH-13": Case("rate_table/kvh13", LINES, table, "published_ladder", changes=DECLARED, runs=24),
    # Two rates tell of no asymmetry.
    "B-215, optimal": Case(
        "rate_table/b215", LINES, table, "optimal_ladder", changes=DECLARED, without=("asymmetry",), runs=24
    ),
}


@lru_cache(maxsize=1)
def runs_of(name: str) -> tuple[Task, RollOut]:
    """The runs of a case, played once for all that watch them, beside the first of these."""
    case = CASES[name]
    task = task_of(case.scenario, dict(case.changes))
    return task, roll_out(task, case.player(task), case.estimators[0], range(case.runs), every=10**6)


def estimate(name: str, estimator: str) -> Estimate:
    """What is told at the end of all runs."""
    task, played = runs_of(name)
    if estimator == CASES[name].estimators[0]:
        assert played.estimate is not None
        return played.estimate
    made = find(ESTIMATORS, estimator)(task.datasheet)
    state = made.reset(CASES[name].runs)
    for rows, chunk in played.chunks:
        assert len(rows) == CASES[name].runs  # none ends before the others
        state = made.update(state, chunk)
    found: Estimate = made.estimate(state)
    return found


def judged(name: str, estimator: str) -> dict[str, float]:
    """NEES over all that has a truth, and the mean of z^2 of each of its quantities."""
    case, (task, played), found = CASES[name], runs_of(name), estimate(name, estimator)
    true = {name: value for name, value in case.truth(case, task, played).items() if name not in case.without}
    names = [name for name in found.names if name in true]
    at = [found.names.index(name) for name in names]
    error = np.stack([found.mean[:, j] - true[name] for j, name in zip(at, names, strict=True)], axis=-1)
    for k, name in enumerate(names):
        if name in ANGLES:
            error[:, k] = np.angle(np.exp(1j * error[:, k]))
    cov = found.cov[:, at][:, :, at]
    square = np.einsum("ri,ri->r", error, np.linalg.solve(cov, error[..., None])[..., 0])
    z = np.mean(error**2 / np.diagonal(cov, axis1=1, axis2=2), axis=0)
    return {"NEES": float(square.mean() / len(names)), **dict(zip(names, z.tolist(), strict=True))}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "estimator"), [(name, e) for name, case in CASES.items() for e in case.estimators])
def test_an_estimator_errs_as_it_tells(name: str, estimator: str) -> None:
    found, runs = judged(name, estimator), CASES[name].runs
    whole = found.pop("NEES")
    for figure, value, freedom in [("NEES", whole, runs * len(found)), *((q, v, runs) for q, v in found.items())]:
        low, high = chi2.ppf([CHANCE / 2, 1 - CHANCE / 2], freedom) / freedom
        assert low * (1 - ROOM) < value < high * (1 + ROOM), (figure, found | {"NEES": whole})
