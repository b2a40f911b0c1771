"""Covariance analysis without sampling, for `bounds_judged`: where per cents go, and what undeclared effects do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from studies.result_page import Section, table

from estimators.north_finder.gls import NorthGls
from estimators.rate_table import rate_dwells
from estimators.rate_table.rate_gls import RateGls
from estimators.rate_table.rate_line import RateLine
from estimators.two_position.joint import TwoPositionJoint
from estimators.two_position.transposition import instrument
from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet, Estimate, Estimator
from insenv.core.motion import Motion
from insenv.core.recording import Recording
from insenv.core.units import ARCMIN, ARCSEC, DEG, DEG_PER_HOUR, PPM
from insenv.effects.angle import EarthRate
from insenv.effects.bias import BiasDrift
from insenv.effects.catalogue import by_key
from insenv.effects.rate.scale import ScaleFactor
from insenv.envs.rollout import RollOut, roll_out
from insenv.envs.task import Task
from insenv.evaluate.bounds import bounds
from insenv.evaluate.runs import task_of
from insenv.information.alignment import AlignedUnit, Stretch, bound, procedure
from insenv.information.alignment_response import responses
from insenv.information.fisher import IncrementNoise, information, north_bound
from insenv.information.means import Means, means, stated_noises
from insenv.information.polynomial import BIAS_SD, SCALE_SD, BiasPolynomial, ScaleFactorPolynomial
from insenv.information.rate_noise import white_angle
from insenv.information.scale_factor import INTERVAL, cells, declared, motion_of, slope
from insenv.information.sensitivity import efficient, sensitivity
from insenv.information.table_motion import steady

#: Runs with and without an effect, on the same noise: their difference has next to no chance in it.
PAIRED = 8
_NO_SIGHT = {"sight.tracking": "0 arcsec", "sight.position_error": "0 m", "instrument.sampling": "20 Hz"}
_DECLARED = {"undeclared": {}, "instrument.sampling": "20 Hz"}
_SHORT = {**_DECLARED, "duration": "300 s"}


def north_shares() -> Section:
    """What it costs that `north_gls` leaves a polynomial of the scale factor free, whatever is declared."""
    rows = []
    for policy, duration in (("constant_rate", "300 s"), ("bidirectional", "300 s"), ("bidirectional", "60 s")):
        task = task_of("north_finder/published", {"duration": duration})
        sheet, run = task.datasheet, roll_out(task, policy, None, (0,)).recording(0)
        motion = motion_of(sheet, run.values("table_angle", "rad"), sheet.dt)
        free = (EarthRate(), ScaleFactorPolynomial(2, sheet.duration), BiasPolynomial(0, sheet.duration))
        noise = IncrementNoise(sheet.coefficient("gyro", "angle_random_walk"), white_angle(sheet))
        prior = {f"scale_factor_polynomial.c{j}": SCALE_SD for j in range(3)} | {"bias_polynomial.c0": BIAS_SD}
        told = information(motion, free, noise, stretches=steady(motion)).given(prior).bound()
        level = EARTH_RATE * float(np.cos(sheet.site.latitude or 0.0) * np.cos(sheet.mounting.tilt))
        least = bounds(sheet, run, ("azimuth",))["azimuth"]
        rows.append((policy, duration, least / ARCSEC, north_bound(told, level) / ARCSEC))
    shown = [(f"`{p}`", d, f"{a:.1f}", f"{b:.1f}", f"{b / a - 1:+.1%}") for p, d, a, b in rows]
    header = ("policy", "time", "bound [arcsec]", "with a free polynomial [arcsec]", "cost")
    return Section(
        "What `north_gls` leaves free",
        (
            "The datasheet declares scale factor (10 ppm), its warm-up and the bias; `north_gls` fits a polynomial of "
            "degree 2 and a bias beside the azimuth all the same, so that a wrong declaration does no harm.",
            "",
            *table(header, shown),
        ),
        f"{max(b / a - 1 for _, d, a, b in rows if d != '60 s'):.1%} at most in 300 s; in 60 s, where neither sense "
        f"completes a turn, a factor of {rows[-1][3] / rows[-1][2]:.1f}, which is no loss of the data but the price of "
        "not believing the datasheet.",
    )


def two_position_shares() -> Section:
    """What the joint estimator leaves of the record, by the deviation that it tells."""
    rows = []
    for noise in ("a", "a2", "b"):
        task = task_of(f"two_position/published_{noise}", _NO_SIGHT)
        played = roll_out(task, "published_schedule", None, (0, 1))
        known, course = instrument(TwoPositionJoint(task.datasheet).told), _course()
        least = bound(known, course).installation
        told = [
            _after(made, played).of("installation_angle")[1].mean()
            for made in (TwoPositionJoint(task.datasheet, residual=(0.0, 2.0)), TwoPositionJoint(task.datasheet))
        ]
        steps = [bound(known, course, turning_data=False).installation, *told]
        rows.append((noise.upper(), f"{least / ARCMIN:.4f}", *(f"{value / least - 1:+.1%}" for value in steps)))
    lines = (
        "Deviation of the inertial part of the installation angle [arcmin] and what is lost, one after the other.",
        "",
        *table(
            ("noise", "bound", "without the velocities of the turn", "velocity free at each rest", "3 mm/s left"), rows
        ),
    )
    last = max(float(row[-1].rstrip("%")) for row in rows)
    return Section(
        "What `two_position_joint` leaves unused",
        lines,
        f"{last:.1f} % at most, by choice: the velocities of a turn are those of a point away from the pivot, which no "
        "datasheet tells, and a vehicle may still move by 3 mm/s when its turn has ended (`RESIDUAL`). What a table "
        "has beyond that is the spread of z, and chance.",
    )


def _course() -> tuple[Stretch, ...]:
    return procedure(300.0, [170 * DEG], 20.0)


def _after(estimator: Estimator, played: RollOut) -> Estimate:
    """What an estimator tells at the end of the runs."""
    state = estimator.reset(len(played.seeds))
    for _, chunk in played.chunks:
        state = estimator.update(state, chunk)
    return estimator.estimate(state)


def turns_left_out() -> Section:
    """What the robust line loses: whole turns, weights of white noise."""
    rows, lost = [], []
    for said, policy, changes in (
        ("the paper's 36 rates", "published_ladder", _DECLARED),
        ("a sweep and dwells", "sweep_and_refine", _DECLARED),
        ("two rates, 300 s", "optimal_ladder", _SHORT),
    ):
        task = task_of("rate_table/b215", changes)
        run = roll_out(
            task, policy, "rate_line", (0,), every=1 if policy == "sweep_and_refine" else 1_000_000
        ).recording(0)
        all_of_it, dwells, white, share = _line_analysis(task.datasheet, run)
        rows.append((said, *(f"{v / PPM:.2f}" for v in (all_of_it, dwells, white)), f"{share:.0%}"))
        lost.append(dwells / all_of_it - 1)
    header = ("procedure", "all cells", "means of whole turns", "the same, weighed by their time", "time used")
    return Section(
        "What `rate_line` leaves unused",
        ("Deviation of the scale factor [ppm] of the B-215, covariance analysis of one run.", "", *table(header, rows)),
        f"It keeps whole turns alone, which takes what goes with the angle out of a dwell and costs {min(lost):.0%} to "
        f"{max(lost):.0%}; weights that know of white noise only cost little. What a Monte Carlo shows beyond that is "
        "the price of robust weights. `rate_gls` uses all cells and the covariance of all noises; "
        "it believes the datasheet, and is no answer where an anomaly is looked for.",
    )


def _line_analysis(sheet: Datasheet, run: Recording) -> tuple[float, float, float, float]:
    """Deviations with all cells, with means of dwells, with weights by time; share of the time in dwells."""
    line = RateLine(sheet)
    dwells = rate_dwells.finished(line.update(line.reset(), run).found, line._settings)
    found = dwells.dwells[: int(dwells.count)]
    motion = _motion(sheet, run)
    told, noises = declared(sheet, motion), stated_noises(sheet, "gyro")
    begins = found[:, rate_dwells.START] - run.t[0]
    marks = np.rint(np.stack([begins, begins + found[:, rate_dwells.TIME]]) / INTERVAL).astype(int).clip(0, motion.n)
    edges = np.unique([0, *marks.ravel(), motion.n])
    middle = 0.5 * (edges[1:] + edges[:-1])
    kept = ((middle[:, None] > marks[0]) & (middle[:, None] < marks[1])).any(axis=1)
    whole = means(motion, told.sensor, noises, cells(motion.rate), theta=told.mean)
    some = means(motion, told.sensor, noises, edges, kept, told.mean)
    white = means(
        motion, told.sensor, [n for n in noises if n.effect.id == "angle_random_walk"], edges, kept, told.mean
    )
    # The line knows no prior.
    free = {**told.sd, "scale_factor.c": np.inf, "bias.c": np.inf}
    used = float(np.diff(edges)[kept].sum() / motion.n)
    return _sd(whole, whole, told.sd), _sd(some, some, free), _sd(white, some, free), used


def _motion(sheet: Datasheet, run: Recording) -> Motion:
    rows = round(INTERVAL * sheet.sampling)
    angle, temperature = run.values("table_angle", "rad")[::rows], run.values("temperature", "K")[::rows]
    return motion_of(sheet, angle, rows * sheet.dt, temperature)


def _sd(assumed: Means, true: Means, prior: Mapping[str, float]) -> float:
    """Deviation of the scale factor by the estimator that is efficient for ``assumed``, under the noise of ``true``."""
    found = efficient(assumed, prior)
    j = found.names.index("scale_factor.c")
    return float(np.sqrt(found.errors(true)[j, j]))


def sensitivities() -> Section:
    """Bias by an undeclared effect: predicted, and simulated as the difference of runs with and without it."""
    rows = [_north(), _vehicle(), *_rates()]
    header = ("environment", "undeclared", "predicted bias", "simulated", "bias / deviation")
    off = max(abs(row[4] / row[3] - 1) for row in rows)
    shown = [
        (e, u, f"{p / s:.3g} {unit}", f"{m / s:.3g} {unit}", f"{abs(p) / d:.2g}") for e, u, (s, unit), p, m, d in rows
    ]
    return Section(
        "What an undeclared effect does, without sampling",
        (
            "Bias of the efficient estimator by `insenv.information.sensitivity` and "
            "`insenv.information.alignment_response`, "
            f"beside the mean difference of {PAIRED} runs with and without the effect on the same noise.",
            "",
            *table(header, shown),
        ),
        f"Prediction and simulation differ by {off:.1%} at most.",
    )


Row = tuple[str, str, tuple[float, str], float, float, float]


def _differences(
    scenario: str, policy: str, estimator: Any, quantity: str, changes: Any, added: Any
) -> tuple[float, Task]:
    """Mean error with an undeclared effect less that without."""
    errors = []
    none: dict[str, Any] = {}
    for undeclared in (none, added):
        task = task_of(scenario, {**changes, "undeclared": undeclared})
        played = roll_out(task, policy, None, range(PAIRED))
        mean = _after(estimator(task.datasheet), played).of(quantity)[0]
        errors.append(mean - played.truth[quantity])
    difference = np.angle(np.exp(1j * (errors[1] - errors[0]))) if quantity != "scale_factor" else errors[1] - errors[0]
    return float(difference.mean()), task


def _rates() -> list[Row]:
    rows = []
    for said, key, values, added in (
        ("scale factor drifts by 10 ppm/h", "scale_factor_drift", [10 * PPM / 3600], {"c": "10 ppm/h"}),
        (
            "rate of 1 deg/h locked to the angle",
            "angle_locked_rate:1",
            [DEG_PER_HOUR, 0.0],
            {"c": "1 deg/h", "s": "0 deg/h"},
        ),
    ):
        simulated, task = _differences(
            "rate_table/b215", "optimal_ladder", RateGls, "scale_factor", _SHORT, {key: added}
        )
        sheet = task.datasheet
        motion = _motion(sheet, roll_out(task, "optimal_ladder", None, (0,)).recording(0))
        told = declared(sheet, motion)
        model = means(motion, told.sensor, stated_noises(sheet, "gyro"), cells(motion.rate), theta=told.mean)
        (found,) = sensitivity(model, [(by_key(key), values)], told.sd)
        weights, _ = slope(told, sheet, task.datasheet.limits.rate)
        sd = found.sd[found.names.index("scale_factor.c")]
        rows.append(("rate table, 300 s", said, (PPM, "ppm"), found.of(weights), simulated, float(sd)))
    return rows


def _vehicle() -> Row:
    drift = 0.01 * DEG_PER_HOUR / 3600
    simulated, task = _differences(
        "two_position/published_a2",
        "published_schedule",
        TwoPositionJoint,
        "installation_angle",
        _NO_SIGHT,
        {"bias_drift": {"targets": ["gyro_x"], "c": "0.01 deg/h/h"}},
    )
    known: AlignedUnit = instrument(TwoPositionJoint(task.datasheet).told)
    (found,) = responses(known, _course(), [("gyro_x", BiasDrift(), [drift])])
    j = found.names.index("phi_up")
    return (
        "two positions, A2",
        "gyro x drifts by 0.01 deg/h/h",
        (ARCMIN, "arcmin"),
        found.bias[j],
        simulated,
        found.sd[j],
    )


def _north() -> Row:
    eccentric, scenario, policy = 0.02 * ARCSEC, "north_finder/published", "constant_rate"
    # Pulses would count otherwise with the effect than without.
    changes = {"table.azimuth": "60 deg", "instrument.gyro.pulses": False}
    added = {"encoder_harmonic:1": {"c": "0 arcsec", "s": "0.02 arcsec"}}
    simulated, task = _differences(scenario, policy, NorthGls, "azimuth", changes, added)
    sheet, played = task.datasheet, roll_out(task, policy, None, (0,))
    motion = motion_of(sheet, played.recording(0).values("table_angle", "rad"), sheet.dt)
    edges = np.arange(0, motion.n + 1, 20)
    model = means(motion, (EarthRate(), ScaleFactor()), stated_noises(sheet, "gyro"), edges)
    (found,) = sensitivity(model, [(by_key("encoder_harmonic:1"), [0.0, eccentric])])
    level = EARTH_RATE * np.cos(sheet.site.latitude or 0.0) * np.cos(sheet.mounting.tilt)
    azimuth = float(played.truth["azimuth"][0])
    across = (found.bias[1] * np.cos(azimuth) - found.bias[0] * np.sin(azimuth)) / level
    said = "encoder eccentric by 0.02 arcsec"
    return ("north, 300 s one way", said, (ARCSEC, "arcsec"), float(across), simulated, float(found.sd[0] / level))
