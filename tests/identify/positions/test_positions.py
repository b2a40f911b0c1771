"""A triad held still in many attitudes: rests, accelerometers by the magnitude of gravity, gyros from rest to rest.

What is simulated has matrices of its own (`positions_cases`); nothing of the effects under test is used for it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from positions_cases import (
    ACCELS,
    DT,
    FACES,
    GYROS,
    NAVIGATION,
    PHONE,
    Bench,
    Case,
    G,
    faces,
    least_squares,
    manifest,
    recording,
    scales,
    tied,
)

from insenv.calibration import calibration
from insenv.close import close
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.recording import Channel, Floats, Recording, Segment, Site
from insenv.data.manifest import HeldOut, KnownPositions, Model, load_manifest
from insenv.data.save import save
from insenv.effects.catalogue import by_key
from insenv.identify.findings import TargetFindings
from insenv.identify.positions.accel import Magnitudes, uncertain_directions
from insenv.identify.positions.findings import position_findings
from insenv.identify.positions.least_squares import Fit
from insenv.identify.positions.leave_out import left_out
from insenv.identify.positions.model import Linear, Surroundings, triad_term
from insenv.identify.positions.rests import find_rests
from insenv.identify.positions.search import Outcome
from insenv.identify.positions.trace import Positions, _uncertain, trace_positions
from insenv.identify.positions.turn import turned
from insenv.report.html import to_html
from insenv.report.json import to_json
from insenv.report.text import summary

CALIBRATED = ("accel_bias", "accel_scale_factor")
ACCEL_TRUTH = (0.1, -0.2, 0.05, 2e-3, -1e-3, 3e-3)
SCALED = scales(*ACCEL_TRUTH[3:])
CROOKED = tied(1e-3, -0.7e-3, 0.5e-3)
TURNED = tied(4e-3, 5e-3, -6e-3, -1.0)


def trace(
    case: Case,
    seed: int,
    targets: tuple[str, ...] = ACCELS,
    declared: tuple[str, ...] = CALIBRATED,
    tried: tuple[str, ...] | None = None,
) -> Positions:
    effects = None if tried is None else tuple(map(by_key, tried))
    return trace_positions(manifest(targets, declared), (recording(case, seed),), effects)


def names(outcome: Outcome) -> list[str]:
    return sorted(step.term.effect.key for step in outcome.steps)


def z_scores(fit: Fit, truth: Mapping[str, tuple[float, ...]]) -> list[float]:
    """Errors in standard deviations of all coefficients of the terms named in ``truth``."""
    scores = []
    for term in fit.terms:
        own = fit.of(term)
        scores += list((fit.theta[own] - truth[term.effect.key]) / fit.sd()[own])
    return scores


# ------------------------------------------------------------------------------------------------- rests


def found_rows(run: Recording) -> list[tuple[int, int]]:
    channels = [name for name in run.channels if name[:5] in ("accel", "gyro_")]
    model = manifest(ACCELS, CALIBRATED, HeldOut(positions=(1,)))
    return [(r.start, r.stop) for r in find_rests(model, (run,), channels).rests]


@settings(max_examples=25, deadline=None)
@given(
    rests=st.integers(3, 12),
    rest_s=st.floats(2.2, 6.0),
    turn_s=st.floats(0.8, 3.0),
    noise=st.floats(1e-4, 0.1),
    unit=st.sampled_from([1.0, 1e-3, 415.0]),
    seed=st.integers(0, 10**6),
)
def test_every_rest_is_found_and_nothing_that_moves(
    rests: int, rest_s: float, turn_s: float, noise: float, unit: float, seed: int
) -> None:
    case = Case(rests=rests, rest_s=rest_s, turn_s=turn_s, accel_noise=noise, gyro_noise=0.05 * noise)
    run = recording(case, seed)
    # The unit does not matter: the quiet level is the recording's own.
    run = replace(run, channels={n: replace(c, values=unit * c.values) for n, c in run.channels.items()})
    still, period = round(rest_s / DT), round(rest_s / DT) + round(turn_s / DT)
    found = found_rows(run)
    assert len(found) == rests
    for k, (start, stop) in enumerate(found):
        assert k * period <= start < stop <= k * period + still
        assert stop - start >= 0.5 * still - 2 * round(0.5 / DT)


def test_a_gap_in_time_ends_a_rest() -> None:
    run = recording(Case(rests=3, rest_s=6.0), 1)
    later = run.t + np.where(np.arange(len(run)) >= 150, 10.0, 0.0)  # in the middle of the first rest
    assert len(found_rows(replace(run, t=later))) == 4


def test_a_knock_parts_a_rest_and_what_is_too_short_is_counted() -> None:
    run = recording(Case(rests=3, rest_s=4.0), 1)
    accel = run.channels["accel_x"].values.copy()
    accel[60:66] += 8.0  # 1.2 s after the start of the first rest
    knocked = replace(run, channels={**run.channels, "accel_x": Channel(accel, "m/s^2")})
    found = find_rests(manifest(ACCELS, CALIBRATED), (knocked,), list(run.channels))
    assert len(found.rests) == 3
    assert found.rests[0].start > 66
    assert any("1 still stretch left out, shorter than 2 s" in text for text in found.remarks)


def test_labels_are_rests_but_for_those_that_move() -> None:
    case = Case(rests=4, rest_s=3.0, turn_s=2.0)
    run = recording(case, 2)
    segments = tuple(Segment(f"at {k}", 250 * k, 250 * k + 150) for k in range(4)) + (Segment("turn", 150, 250),)
    found = find_rests(manifest(ACCELS, CALIBRATED), (replace(run, segments=segments),), list(run.channels))
    assert [(r.start, r.stop) for r in found.rests] == [(250 * k, 250 * k + 150) for k in range(4)]
    assert any("segment turn left out" in text for text in found.remarks)


@pytest.mark.parametrize("rows", [2, 4, 7, 8])
def test_a_label_of_few_rows_is_a_rest_whatever_the_next_position_is(rows: int) -> None:
    """A table of positions, each with a few readings: no window is of one position alone."""
    run = recording(Case(rests=12, rest_s=3.0, turn_s=1.0), 4)
    still = np.concatenate([np.arange(200 * k + 20, 200 * k + 20 + rows) for k in range(12)])
    channels = {n: replace(c, values=c.values[still]) for n, c in run.channels.items()}
    segments = tuple(Segment(f"at {k}", rows * k, rows * k + rows) for k in range(12))
    table = replace(run, t=run.t[: len(still)], channels=channels, segments=segments)
    found = find_rests(manifest(ACCELS, CALIBRATED), (table,), list(table.channels))
    assert len(found.rests) == 12 and not any("moves" in text for text in found.remarks)


def test_gyros_in_a_table_of_positions_are_judged_by_their_means() -> None:
    """The turns between the rows were not recorded; a g-sensitivity shows all the same."""
    rng = np.random.default_rng(5)
    up = rng.standard_normal((30, 3))
    force = 9.81 * up / np.linalg.norm(up, axis=1, keepdims=True) + 1e-3 * rng.standard_normal((30, 3))
    rate = 0.01 + 2e-4 * force[:, [1, 2, 0]] + 1e-4 * rng.standard_normal((30, 3))
    channels = {f"accel_{a}": Channel(force[:, i], "m/s^2") for i, a in enumerate("xyz")}
    channels |= {f"gyro_{a}": Channel(rate[:, i], "rad/s") for i, a in enumerate("xyz")}
    segments = tuple(Segment(str(k), k, k + 1) for k in range(30))
    run = Recording(np.arange(30.0), channels, segments, Site(gravity=9.81), label="table")
    found = trace_positions(manifest((*GYROS, *ACCELS), ("accel_bias", "bias")), (run,))
    assert found.gyro is None
    assert [names(part.outcome) for part in found.at_rest] == [["g_sensitivity"]] * 3


@pytest.mark.parametrize(("positions", "held"), [("even", [2, 4, 6]), ("odd", [1, 3, 5]), ((3, 4), [3, 4])])
def test_what_is_held_out(positions: str | tuple[int, ...], held: list[int]) -> None:
    model = manifest(ACCELS, CALIBRATED, HeldOut(positions=positions))
    run = recording(Case(rests=6), 3)
    assert [r.number for r in find_rests(model, (run,), list(run.channels)).rests if r.held_out] == held


def test_rests_of_two_runs_are_counted_through() -> None:
    runs = tuple(recording(Case(rests=3), seed) for seed in (1, 2))
    model = manifest(ACCELS, CALIBRATED, HeldOut(runs=(2,)))
    model = replace(model, runs=(None, None))  # type: ignore[arg-type]
    found = find_rests(model, runs, list(runs[0].channels)).rests
    assert [(r.number, r.run, r.held_out) for r in found] == [
        *((k, 0, False) for k in (1, 2, 3)),
        *((k, 1, True) for k in (4, 5, 6)),
    ]


# ------------------------------------------------------------------------------------------------- the model


@pytest.mark.parametrize(("lost", "turns"), [(1, 15), (20, 0)])
def test_a_row_that_a_logger_lost_hides_no_turn(lost: int, turns: int) -> None:
    """Its step is of a time in which a hand's rate goes straight; one of 0.4 s hides where the turn went."""
    run = recording(Case(rests=16, rest_s=4.0, gyro=scales(0.0, 0.0, 0.05)), 3)
    turning = np.arange(len(run)) % 260 - 200
    kept = (turning < 20) | (turning >= 20 + lost)
    channels = {name: replace(c, values=c.values[kept]) for name, c in run.channels.items()}
    found = trace_positions(manifest(GYROS, ("bias",), HeldOut()), (replace(run, t=run.t[kept], channels=channels),))
    assert (len(found.gyro.problem.turns) if found.gyro else 0) == turns  # type: ignore[union-attr]
    if found.gyro:
        fit = found.gyro.outcome.after
        assert names(found.gyro.outcome) == ["scale_factor"]
        assert fit.theta[2] == pytest.approx(0.05, abs=3 * fit.sd()[2])


@pytest.mark.parametrize("key", ["accel_bias", "accel_scale_factor", "non_orthogonality", "bias_drift"])
def test_the_model_of_a_triad_is_what_the_effects_add(key: str) -> None:
    rng = np.random.default_rng(0)
    term = triad_term(by_key(key))
    around = Surroundings(time=np.sort(rng.uniform(0, 500, 7)))
    force, theta = rng.standard_normal((7, 3)), 0.01 * rng.standard_normal(term.size)
    linear = Linear.of([term], around)
    measured = force.copy()
    for axis in range(3):
        own = np.zeros(len(term.effect.linear))
        for coefficient, value in zip(term.coefficients, theta, strict=True):
            for where, index, factor in coefficient.shares:
                own[index] += factor * value * (where == axis)
        measured[:, axis] += term.effect.apply(force[:, axis], around.motion(force, axis), own)[0]
    np.testing.assert_allclose(linear.corrected(measured, theta), force, atol=1e-12)


def test_derivatives_of_a_turn() -> None:
    rng = np.random.default_rng(1)
    rates, dt = rng.standard_normal((60, 3)), np.full(60, 0.02)
    change = 1e-6 * rng.standard_normal((3, 3))
    attitude, slopes = turned(rates, dt, np.eye(3))
    after, _ = turned(rates, dt, np.eye(3) + change)
    np.testing.assert_allclose(attitude @ attitude.T, np.eye(3), atol=1e-12)
    moved = after @ attitude.T
    phi = 0.5 * np.array([moved[2, 1] - moved[1, 2], moved[0, 2] - moved[2, 0], moved[1, 0] - moved[0, 1]])
    np.testing.assert_allclose(np.einsum("abc,bc->a", slopes, change), phi, rtol=1e-3, atol=1e-9)


# ------------------------------------------------------------------------------------------------- what is found


def test_non_orthogonality_of_one_milliradian_is_found_and_named() -> None:
    found = trace(Case(accel=SCALED + CROOKED), seed=5)
    assert names(found.accel.outcome) == ["non_orthogonality"]
    assert found.accel.reasons == ()
    truth = {"accel_bias": ACCEL_TRUTH[:3], "accel_scale_factor": ACCEL_TRUTH[3:]}
    truth["non_orthogonality"] = (1e-3, -0.7e-3, 0.5e-3)
    assert max(map(abs, z_scores(found.accel.outcome.after, truth))) < 3.5


def test_an_ideal_triad_lacks_nothing() -> None:
    # Family-wise false alarm 1 % for each of five searches (accelerometers, rotations, three gyros at rest): 5 %.
    found = trace(Case(rests=30), seed=6, targets=ACCELS + GYROS, declared=(*CALIBRATED, "bias"))
    assert found.gyro is not None
    for part in (found.accel, found.gyro, *found.at_rest):
        assert names(part.outcome) == [] and part.reasons == ()


def test_the_full_matrix_of_a_gyro_is_found_in_its_parts() -> None:
    matrix = scales(5e-3, -4e-3, 3e-3) + tied(6e-3, -5e-3, 4e-3) + TURNED
    found = trace(Case(gyro=matrix, accel=CROOKED), seed=7, targets=GYROS, declared=("bias",))
    assert found.gyro is not None
    assert names(found.gyro.outcome) == ["misalignment", "non_orthogonality", "scale_factor"]
    truth = {
        "scale_factor": (5e-3, -4e-3, 3e-3),
        "non_orthogonality": (6e-3, -5e-3, 4e-3),
        "misalignment": (4e-3, 5e-3, -6e-3),
    }
    assert max(map(abs, z_scores(found.gyro.outcome.after, truth))) < 4
    assert all(names(part.outcome) == [] for part in found.at_rest)


@pytest.mark.parametrize("scale", [0.75, -0.5])
def test_gyros_of_another_range_have_a_scale_factor(scale: float) -> None:
    """Past half a turn no small correction finds it: the fit begins at the factor that the rotations show."""
    found = trace(Case(gyro=scales(scale, scale + 0.01, scale)), seed=7, targets=GYROS, declared=("bias",))
    assert found.gyro is not None
    assert names(found.gyro.outcome) == ["scale_factor"] and found.gyro.reasons == ()
    truth = {"scale_factor": (scale, scale + 0.01, scale)}
    assert max(map(abs, z_scores(found.gyro.outcome.after, truth))) < 4


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        (np.diag([-1.0, -1.0, -1.0]), "-x, -y, -z"),
        (np.diag([1.0, -1.0, 1.0]), "x, -y, z"),
        (np.eye(3)[[1, 0, 2]], "y, x, z"),
    ],
)
def test_gyros_of_other_signs_or_order_are_said_to_be_so(axes: Floats, words: str) -> None:
    found = trace(Case(gyro=axes - np.eye(3)), seed=7, targets=GYROS, declared=("bias",))
    assert found.gyro is not None
    assert any(f"with the gyros' axes taken as {words} " in reason for reason in found.gyro.reasons), found.gyro.reasons


def test_g_sensitivity_is_found_on_the_gyro_that_has_it() -> None:
    matrix = np.zeros((3, 3))
    matrix[1] = 1e-4, -5e-5, 0.0
    found = trace(Case(g_sensitivity=matrix), seed=8, targets=GYROS, declared=("bias",))
    assert [names(part.outcome) for part in found.at_rest] == [[], ["g_sensitivity"], []]
    fit = found.at_rest[1].outcome.after
    np.testing.assert_array_less(np.abs(fit.theta[1:] - matrix[1]) / fit.sd()[1:], 4)


@pytest.mark.parametrize("latitude", [1.3, -1.3])
def test_the_upward_part_of_the_earths_rate_is_no_g_sensitivity(latitude: float) -> None:
    """Of a unit in the hand with fine gyros it was 7e-6 rad/s per m/s^2; a true one is found beside it, as it is.

    False alarm: 1 % of each of two gyros that have none; a value beyond 4 deviations of few degrees of freedom.
    """
    matrix = np.zeros((3, 3))
    matrix[1] = 2e-5, -1e-5, 3e-5
    case = Case(24, g_sensitivity=matrix, gyro_scatter=1e-6, gyro_noise=1e-5, accel_noise=2e-3, latitude=latitude)
    run = recording(case, 8)
    found, unsaid = (
        trace_positions(manifest(GYROS, ("bias",)), (replace(run, site=Site(gravity=G, latitude=at)),), None)
        for at in (latitude, None)
    )
    assert [names(part.outcome) for part in found.at_rest] == [[], ["g_sensitivity"], []]
    fit = found.at_rest[1].outcome.after
    np.testing.assert_array_less(np.abs(fit.theta[1:] - matrix[1]) / fit.sd()[1:], 4)
    # Where nobody says where the unit is, it is named: by its size, of the sign of the latitude.
    assert [names(part.outcome) for part in unsaid.at_rest] == [["g_sensitivity"]] * 3
    assert unsaid.at_rest[0].outcome.after.theta[1] == pytest.approx(EARTH_RATE * np.sin(latitude) / G, rel=0.4)


def test_what_was_declared_is_not_found_again() -> None:
    case = Case(accel=SCALED + CROOKED)
    found = trace(case, seed=5, declared=(*CALIBRATED, "non_orthogonality"))
    assert names(found.accel.outcome) == []


def test_a_wrong_effect_is_refused() -> None:
    case = Case(gyro=tied(0.02, -0.02, 0.02))
    found = trace(case, seed=3, targets=GYROS, declared=("bias",), tried=("scale_factor",))
    assert found.gyro is not None
    assert names(found.gyro.outcome) == []
    assert [r.effect for r in found.gyro.outcome.rejected] == ["scale_factor"]


def test_with_gravity_unknown_the_mean_scale_factor_is_known_no_better_than_gravity() -> None:
    case = Case(accel=scales(0.02, 0.01, 0.015), gravity=None)
    found = trace(case, seed=10, declared=("accel_bias",))
    assert names(found.accel.outcome) == ["accel_scale_factor"]
    fit = found.accel.outcome.after
    sd = fit.sd()[3:6]
    assert (sd > 1e-3).all()  # 1.5e-3 of gravity over the Earth
    differences = fit.theta[3:6] - fit.theta[3:6].mean()
    np.testing.assert_allclose(differences, [0.005, -0.005, 0.0], atol=5e-4)


def test_a_rest_on_a_moving_bench_is_left_out_and_named() -> None:
    run = recording(Case(), 11)
    values = run.channels["accel_z"].values.copy()
    start, stop = found_rows(run)[4]
    values[start - 5 : stop + 5] += 0.1
    bumped = replace(run, channels={**run.channels, "accel_z": Channel(values, "m/s^2")})
    found = trace_positions(manifest(ACCELS, CALIBRATED), (bumped,))
    assert any(text.startswith("rest 5 (simulated, ") for text in found.remarks)
    assert names(found.accel.outcome) == []


def test_too_few_attitudes_cannot_test_and_say_what_they_need() -> None:
    found = trace(Case(rests=18), seed=12)  # nine fitted, six declared parameters
    (blind,) = [n for n in found.accel.outcome.not_testable if n.effect == "non_orthogonality"]
    assert blind.needs == ("more positions",)
    assert "at least 2 more needed" in blind.reason


def test_attitudes_about_one_axis_do_not_tell() -> None:
    """Of a triad that only turns about a level axis y, nothing tells what x and z have of y."""
    rng = np.random.default_rng(0)
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    force = 9.81 * np.stack([np.sin(angles), np.zeros(24), np.cos(angles)], axis=1)
    rows = np.repeat(force, 100, axis=0) + 1e-3 * rng.standard_normal((2400, 3))
    channels = {f"accel_{a}": Channel(rows[:, i], "m/s^2") for i, a in enumerate("xyz")}
    segments = tuple(Segment(str(k), 100 * k, 100 * k + 100) for k in range(24))
    run = Recording(0.02 * np.arange(2400.0), channels, segments, Site(gravity=9.81), label="ring")
    found = trace_positions(manifest(ACCELS, ("accel_scale_factor",)), (run,), (by_key("non_orthogonality"),))
    assert [n.needs for n in found.accel.outcome.not_testable] == [("other attitudes",)]


# ------------------------------------------------------------------------------------------------- how sure


@pytest.mark.slow
def test_standard_deviations_and_false_alarms_of_the_accelerometers() -> None:
    """60 nulls at alpha = 1 %: four or more false alarms come by chance with probability 0.3 %.

    The root mean square of 360 z-scores (correlated: some 300 free) is within 0.85 to 1.15 but for 0.1 %.
    """
    alarms, scores = 0, []
    truth = {"accel_bias": ACCEL_TRUTH[:3], "accel_scale_factor": ACCEL_TRUTH[3:]}
    for seed in range(60):
        found = trace(Case(accel=SCALED), seed=1000 + seed).accel.outcome
        alarms += bool(found.steps)
        scores += z_scores(found.before, truth)
    assert alarms <= 3
    assert 0.85 < float(np.sqrt(np.mean(np.square(scores)))) < 1.15


@pytest.mark.slow
def test_standard_deviations_of_what_was_found() -> None:
    """30 recordings: the rms of 270 z-scores is within 0.8 to 1.2 but for 0.1 %; each is found."""
    scores, named = [], 0
    truth = {"accel_bias": ACCEL_TRUTH[:3], "accel_scale_factor": ACCEL_TRUTH[3:]}
    truth["non_orthogonality"] = (1e-3, -0.7e-3, 0.5e-3)
    for seed in range(30):
        found = trace(Case(accel=SCALED + CROOKED), seed=2000 + seed).accel.outcome
        if names(found) == ["non_orthogonality"]:
            named += 1
            scores += z_scores(found.after, truth)
    assert named >= 28
    assert 0.8 < float(np.sqrt(np.mean(np.square(scores)))) < 1.2


# ------------------------------------------------------------------------------------------------- command and reports


def saved(tmp_path: Path, run: Recording, model: Model, held_out: HeldOut | None = None) -> Path:
    path = tmp_path / "run.toml"
    save(path, [run], model, title="Simulated", held_out=held_out or HeldOut(positions="even"))
    return path


def test_the_command_reports_it_in_every_form(tmp_path: Path) -> None:
    case = Case(accel=SCALED + CROOKED, gyro=tied(6e-3, -5e-3, 4e-3))
    model = Model(ACCELS + GYROS, (*CALIBRATED, "bias"), procedure="multi-position")
    path = saved(tmp_path, recording(case, 5), model)
    assert load_manifest(path).held_out.positions == "even"
    findings = close(path)
    document = json.loads(json.dumps(to_json(findings), allow_nan=False))
    assert document["verdict"] == "effects-found"
    assert {(a["target"], a["effect"]) for a in document["added"]} == {(t, "non_orthogonality") for t in ACCELS + GYROS}
    assert document["held_out"]["accel_x"]["unit"] == "m/s^2"
    assert document["held_out"]["gyro_x"]["unit"] == "rad"
    for target in ACCELS + GYROS:
        block = document["held_out"][target]
        assert block["after"] < 0.7 * block["before"]
    y = next(a for a in document["added"] if a["target"] == "accel_y")
    assert [p["name"] for p in y["parameters"]] == ["c_x", "c_z"]
    text = summary(findings)
    assert "magnitudes of specific force at rest less gravity" in text and "40 rests" in text
    shown = re.sub(r"<script.*?</script>", "", to_html(findings), flags=re.DOTALL)  # which can draw all there is
    assert "rotations from rest to rest" in shown and "Allan" not in shown


def test_what_was_found_is_taken_out_of_the_whole_triad(tmp_path: Path) -> None:
    case = Case(accel=SCALED + CROOKED, gyro=tied(6e-3, -5e-3, 4e-3) + scales(0.02, 0.01, -0.01))
    run = recording(case, 5)
    (tmp_path / "run.toml").touch()
    model = manifest(ACCELS + GYROS, (*CALIBRATED, "bias"), path=str(tmp_path / "run.toml"))
    found = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0)
    applied = calibration(found, model).apply(run)
    ideal = recording(replace(case, accel=np.zeros((3, 3)), gyro=np.zeros((3, 3)), accel_bias=(0, 0, 0)), 5)
    for name in ACCELS:
        error = applied.channels[name].values - ideal.channels[name].values
        assert float(np.sqrt(np.mean(error**2))) < 0.01  # of errors of some 0.1 m/s^2
    again = trace_positions(model, (applied,))
    assert again.gyro is not None
    for part in (again.accel, again.gyro, *again.at_rest):
        assert names(part.outcome) == []


def test_found_on_one_gyro_at_rest_alone_is_told_in_its_unit() -> None:
    matrix = np.zeros((3, 3))
    matrix[1] = 1e-4, -5e-5, 0.0
    run = recording(Case(g_sensitivity=matrix), 8)
    model = manifest(GYROS, ("bias",))
    found = position_findings(model, (run,), trace_positions(model, (run,)), (), 0.01, 0)
    x, y, _ = found.targets
    assert y.held_out.unit == "rad/s" and y.verdict == "effects-found"
    assert x.held_out.unit == "rad" and x.verdict == "nothing-significant"
    assert any("attitude from the accelerometers" in remark for remark in found.remarks)
    assert isinstance(y, TargetFindings) and "g-sensitivity" in summary(found)


# ------------------------------------------------------------------------------------------------- what is refused


def refusal(tmp_path: Path, case: Case, model: Model, held_out: HeldOut | None = None, without: str = "") -> str:
    run = recording(case, 1)
    run = replace(run, channels={n: c for n, c in run.channels.items() if n != without})
    with pytest.raises(InputError) as error:
        close(saved(tmp_path, run, model, held_out))
    text = str(error.value)
    assert "\n" not in text and "run.toml" in text
    return text


def test_without_rests(tmp_path: Path) -> None:
    model = Model(ACCELS, CALIBRATED, procedure="multi-position")
    text = refusal(tmp_path, Case(rests=1, rest_s=20), model)
    assert "one rest found" in text and "several attitudes" in text
    text = refusal(tmp_path, Case(rests=30, rest_s=0.3), model)
    assert "rest found in simulated" in text


def test_with_an_axis_missing(tmp_path: Path) -> None:
    model = Model(ACCELS[:2], CALIBRATED, procedure="multi-position")
    assert "accel_z missing" in refusal(tmp_path, Case(rests=12), model, without="accel_z")
    model = Model(GYROS, ("bias",), procedure="multi-position")
    text = refusal(tmp_path, Case(rests=12), model, without="accel_y")
    assert "accel_y missing" in text and "attitude reference of the gyros" in text


def test_with_too_few_positions(tmp_path: Path) -> None:
    model = Model(ACCELS, CALIBRATED, procedure="multi-position")
    text = refusal(tmp_path, Case(rests=10), model)
    assert "5 rests to fit for 6 declared parameters" in text and "at least 8" in text


def test_with_positions_that_are_not_there(tmp_path: Path) -> None:
    model = Model(ACCELS, CALIBRATED, procedure="multi-position")
    text = refusal(tmp_path, Case(rests=12), model, HeldOut(positions=(3, 13)))
    assert "held_out.positions has 13; there are 12 rests" in text


@pytest.mark.parametrize("key", ["lock_in", "scale_factor", "earth_rate"])
def test_with_a_declared_effect_that_rests_do_not_show(tmp_path: Path, key: str) -> None:
    model = Model(ACCELS, (*CALIBRATED, key), procedure="multi-position")
    text = refusal(tmp_path, Case(rests=20), model)
    assert f"model.declared has {key!r}" in text and "accel_scale_factor" in text


# ------------------------------------------------------------------------------------------------- manifest


COUNTS = """
data = "a.csv"
[channels]
time = {{ column = "t", unit = "s" }}
accel_x = {{ column = "x", unit = "0.01 m/s^2", offset = 100 }}
accel_y = {{ column = "y", unit = "m/s^2"{more} }}
[model]
target = "accel_x"
declared = ["bias"]
"""


def counts(tmp_path: Path, more: str = "", rows: int = 3) -> Path:
    (tmp_path / "a.csv").write_text("t,x,y\n0,100,1\n1,200,2\n2,0,3\n")
    (tmp_path / "b.csv").write_text("x,y\n" + "1,7\n" * rows)
    path = tmp_path / "m.toml"
    path.write_text(COUNTS.format(more=more))
    return path


def test_an_offset_is_taken_off_before_the_unit(tmp_path: Path) -> None:
    from insenv.data.load import read_recordings

    (run,) = read_recordings(load_manifest(counts(tmp_path)))
    np.testing.assert_allclose(run.channels["accel_x"].values, [0.0, 1.0, -1.0])
    np.testing.assert_allclose(run.channels["accel_y"].values, [1.0, 2.0, 3.0])


def test_a_channel_may_have_a_file_of_its_own(tmp_path: Path) -> None:
    from insenv.data.load import read_recordings

    (run,) = read_recordings(load_manifest(counts(tmp_path, ', file = "b.csv"')))
    np.testing.assert_allclose(run.channels["accel_y"].values, [7.0, 7.0, 7.0])
    path = counts(tmp_path, ', file = "b.csv"', rows=2)
    with pytest.raises(InputError, match=r"b\.csv: has 2 rows against 3 in a\.csv"):
        read_recordings(load_manifest(path))


@pytest.mark.parametrize(
    ("positions", "wanted"),
    [('"evn"', "'even'"), ("[]", "counted from 1"), ("[0]", "counted from 1"), ("1.5", "'even'")],
)
def test_positions_that_name_nothing(tmp_path: Path, positions: str, wanted: str) -> None:
    path = counts(tmp_path)
    path.write_text(path.read_text() + f"[held_out]\npositions = {positions}\n")
    with pytest.raises(InputError) as error:
        load_manifest(path)
    assert "held_out.positions" in str(error.value) and wanted in str(error.value)


def test_positions_need_the_procedure(tmp_path: Path) -> None:
    path = counts(tmp_path)
    path.write_text(path.read_text() + '[held_out]\npositions = "even"\n')
    with pytest.raises(InputError, match="multi-position"):
        close(path)


# ------------------------------------------------------------------------------------------------- few rests


@pytest.mark.parametrize(("bench", "one_file"), [(NAVIGATION, True), (NAVIGATION, False), (PHONE, True)])
def test_the_six_position_test_runs_as_it_is_and_agrees_with_the_textbook(bench: Bench, one_file: bool) -> None:
    """Bias within 0.3 mm/s^2 and scale factor within 30 ppm of twelve parameters by least squares, navigation grade.

    The phone lies level within 0.6 deg: the textbook takes the faces for exact, the magnitude of gravity does not.
    """
    runs = faces(bench, 1, one_file)
    model = replace(manifest(ACCELS, CALIBRATED, HeldOut()), runs=(None,) * len(runs))  # type: ignore[arg-type]
    found = trace_positions(model, runs)
    assert found.remarks[0].startswith("6 rests") and "each cut into 8 parts" in found.remarks[0]
    assert names(found.accel.outcome) == [] and found.accel.reasons == ()
    fit = found.accel.outcome.after
    truth = {"accel_bias": bench.bias, "accel_scale_factor": tuple(np.diag(bench.matrix))}
    assert max(map(abs, z_scores(fit, truth))) < 4
    if bench is NAVIGATION:
        bias, scale = least_squares(faces(bench, 1, one_file=False), bench)
        assert np.abs(fit.theta[:3] - bias).max() < 0.3e-3
        assert np.abs(fit.theta[3:] - scale).max() < 30e-6


@pytest.mark.parametrize("rests", [11, 14, 18, 23])
def test_few_rests_are_held_out_in_turn_and_no_drift_is_named_for_what_follows_the_attitude(rests: int) -> None:
    """Of 12 recordings each, 45 of 48 had the cause found, none a drift instead; these four are of them."""
    case = Case(rests=rests, accel=tied(3e-3, -2e-3, 2.5e-3))
    found = trace_positions(manifest(ACCELS, CALIBRATED, HeldOut()), (recording(case, 5001),))
    assert "each held out in its turn" in found.remarks[0]
    assert "bias_drift" not in names(found.accel.outcome)
    if found.accel.outcome.steps:
        assert names(found.accel.outcome) == ["non_orthogonality"]
    else:
        assert rests < 14


def test_each_left_out_is_what_a_fit_without_it_says() -> None:
    rng = np.random.default_rng(3)
    m, d, p = 9, 2, 4
    x, y = rng.standard_normal((m * d, p)), rng.standard_normal(m * d)
    half = rng.standard_normal((m * d, m * d))
    covariance = half @ half.T + np.eye(m * d)
    root = np.asarray(np.linalg.cholesky(covariance), np.float64)
    white = np.linalg.solve(root, np.column_stack([y, x]))
    inverse = np.asarray(np.linalg.inv(white[:, 1:].T @ white[:, 1:]), np.float64)
    fit = inverse @ white[:, 1:].T @ white[:, 0]
    residual = np.asarray((white[:, 0] - white[:, 1:] @ fit).reshape(m, d), np.float64)
    slopes = np.asarray(-white[:, 1:].reshape(m, d, p), np.float64)
    each = left_out(root, residual, slopes, inverse, np.ones(m, dtype=bool))
    for i in range(m):
        keep = np.arange(m * d) // d != i
        weight = np.linalg.inv(covariance[np.ix_(keep, keep)])
        other = np.linalg.solve(x[keep].T @ weight @ x[keep], x[keep].T @ weight @ y[keep])
        np.testing.assert_allclose(each[i], y[~keep] - x[~keep] @ other, rtol=1e-8)


def test_a_rest_that_alone_tells_an_axis_does_not_speak_against_a_model() -> None:
    """One rest alone has the second axis up: the others foretell nothing of it, and it judges no model."""
    slopes = np.array([[1.0, 1e-3], [-1.0, 2e-3], [0.5, -1e-3], [0.3, 1.0], [0.9, 1e-3]])[:, None, :]
    residual = np.array([0.1, -0.2, 0.1, 0.0, 0.1])[:, None]
    inverse = np.asarray(np.linalg.inv(slopes[:, 0].T @ slopes[:, 0]), np.float64)
    each = left_out(np.eye(5), residual, slopes, inverse, np.ones(5, dtype=bool))
    assert np.isinf(each[3]).all()
    assert np.isfinite(np.delete(each, 3)).all()


def test_a_hand_that_trembles_and_a_unit_that_settles_do_not_hide_the_scale_factor() -> None:
    """Half of 24 rests by hand, all with settling: the gyros' whole matrix as from rests on a bench."""
    matrix = scales(6e-3, -5e-3, 4e-3) + tied(4e-3, -4e-3, 3e-3)
    case = Case(rests=24, gyro=matrix, settling=2e-3, tremor=2e-3, tremor_rests=12, rest_s=4.0)
    model = manifest(GYROS, ("bias",), HeldOut(positions="leave-one-out"))
    found = trace_positions(model, (recording(case, 4),))
    assert found.gyro is not None
    assert len(found.rests) > 20 > len(found.calm) >= 11
    assert {"scale_factor", "non_orthogonality"} <= set(names(found.gyro.outcome))
    assert all(names(part.outcome) == [] for part in found.at_rest)
    after = found.gyro.outcome.after
    (term,) = [t for t in after.terms if t.effect.key == "scale_factor"]
    at = after.of(term)
    assert np.abs((after.theta[at] - [6e-3, -5e-3, 4e-3]) / after.sd()[at]).max() < 4


def test_a_scale_factor_four_times_its_deviation_is_found_in_noisy_turns() -> None:
    """A phone's 17 rests: turns miss by 0.4 deg, of which 0.8 % on one axis is a part (p = 3e-4)."""
    case = Case(rests=17, gyro=scales(8e-3, 0.0, 2e-3), gyro_noise=0.01, accel_scatter=5e-4)
    found = trace_positions(manifest(GYROS, ("bias",), HeldOut()), (recording(case, 3),))
    assert found.gyro is not None
    assert names(found.gyro.outcome) == ["scale_factor"]


def test_directions_are_as_uncertain_as_the_calibration_is() -> None:
    rng = np.random.default_rng(0)
    terms, around = [triad_term(by_key(key)) for key in CALIBRATED], Surroundings(np.arange(5.0))
    m, theta = 9.8 * rng.standard_normal((5, 3)), 1e-2 * rng.standard_normal(6)
    half = 1e-3 * rng.standard_normal((6, 6))
    away = uncertain_directions(m, around, terms, theta, half @ half.T)
    drawn = theta + 1e-2 * rng.standard_normal((4000, 6)) @ half.T
    force = np.array([Linear.of(terms, around).corrected(m, each) for each in drawn])
    unit = force / np.linalg.norm(force, axis=2)[:, :, None]
    for k in range(5):
        np.testing.assert_allclose(
            np.cov(unit[:, k].T), 1e-4 * away[k] @ away[k].T, atol=0.1 * 1e-4 * np.trace(away[k] @ away[k].T)
        )


@pytest.mark.parametrize("rests", [8, 9])
def test_as_many_rests_as_errors_of_the_calibration_leave_no_false_certainty(rests: int) -> None:
    """Nine coefficients fit nine magnitudes whatever they are: what is left is no noise (singular, once)."""
    for seed in range(8):
        found = trace_positions(manifest(GYROS, ("bias",), HeldOut()), (recording(Case(rests=rests), seed),))
        problem = found.accel.problem
        assert isinstance(problem, Magnitudes)
        width = np.sqrt(np.sum(_uncertain(found.accel, problem.measured, problem.around) ** 2, axis=(1, 2)))
        assert np.all(width > 1e-5)  # 1 mm/s^2 of scatter, and coefficients that nothing tells


# ------------------------------------------------------------------------------------------------- known attitudes


def stated(up: np.ndarray, tolerance: float) -> KnownPositions:
    return KnownPositions(tuple((float(x), float(y), float(z)) for x, y, z in up), tolerance)


@pytest.mark.parametrize("one_file", [True, False])
def test_stated_faces_tell_what_a_textbook_does(one_file: bool) -> None:
    """Bias within 0.3 mm/s^2 and scale factor within 30 ppm of twelve parameters by least squares."""
    runs = faces(NAVIGATION, 1, one_file)
    model = replace(manifest(ACCELS, CALIBRATED, HeldOut()), positions=stated(FACES, 5e-5))
    found = trace_positions(replace(model, runs=(None,) * len(runs)), runs)  # type: ignore[arg-type]
    assert "each held out in its turn" in found.remarks[0]
    bias, scale = least_squares(faces(NAVIGATION, 1, one_file=False), NAVIGATION)
    fit = found.accel.outcome.after
    at = {term.effect.key: fit.of(term) for term in fit.terms}
    assert np.abs(fit.theta[at["accel_bias"]] - bias).max() < 0.3e-3
    assert np.abs(fit.theta[at["accel_scale_factor"]] - scale).max() < 30e-6


def test_five_stated_faces_are_enough_and_six_tell_the_non_orthogonality() -> None:
    crooked = replace(NAVIGATION, matrix=np.diag([180e-6, -240e-6, 90e-6]) + tied(2e-3, -1e-3, 1.5e-3))
    runs = faces(crooked, 2, one_file=False)
    model = replace(manifest(ACCELS, CALIBRATED, HeldOut()), runs=(None,) * 6)  # type: ignore[arg-type]
    found = trace_positions(replace(model, positions=stated(FACES, 1e-4)), runs)
    assert names(found.accel.outcome) == ["non_orthogonality"]
    fit = found.accel.outcome.after
    np.testing.assert_allclose(fit.theta[6:9], [2e-3, -1e-3, 1.5e-3], atol=1e-4)
    few = runs[:5]
    fewer = replace(model, runs=(None,) * 5, positions=stated(FACES[:5], 1e-4))  # type: ignore[arg-type]
    fit = trace_positions(fewer, few).accel.outcome.before
    assert np.abs(fit.theta[:3] - crooked.bias).max() < 0.03


def test_stated_attitudes_that_are_others_or_too_few(tmp_path: Path) -> None:
    runs = faces(PHONE, 1, one_file=False)
    model = replace(manifest(ACCELS, CALIBRATED, HeldOut()), runs=(None,) * 6)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"rest 3 reads \+y up"):
        trace_positions(replace(model, positions=stated(FACES[[0, 1, 3, 2, 4, 5]], 0.01)), runs)
    with pytest.raises(InputError, match="has 5 directions; there are 6 rests"):
        trace_positions(replace(model, positions=stated(FACES[:5], 0.01)), runs)


def test_attitudes_in_a_manifest(tmp_path: Path) -> None:
    path = counts(tmp_path)
    text = path.read_text().replace("[model]", '[model]\nprocedure = "multi-position"')
    path.write_text(text + '[positions]\nup = ["+x", "-z", [0, 3, 4]]\ntolerance = "0.1 deg"\n')
    known = load_manifest(path).positions
    assert known is not None and known.tolerance == pytest.approx(np.deg2rad(0.1))
    np.testing.assert_allclose(np.array(known.up), np.array([[1.0, 0, 0], [0, 0, -1], [0, 0.6, 0.8]]))
    for wrong in ('["w"]', "[[0, 0, 0]]", "[[1, 2]]"):
        path.write_text(text + f"[positions]\nup = {wrong}\n")
        with pytest.raises(InputError, match=r"positions.up has .*wanted an axis"):
            load_manifest(path)
    path.write_text(path.read_text().replace("multi-position", "static"))
    with pytest.raises(InputError):
        load_manifest(path)
