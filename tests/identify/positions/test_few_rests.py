"""Few rests: the six-position test as it is, each rest held out in its turn, attitudes that a manifest states."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from attitudes.traced import CALIBRATED, names, z_scores
from positions_cases import (
    ACCELS,
    FACES,
    GYROS,
    NAVIGATION,
    PHONE,
    Bench,
    Case,
    faces,
    least_squares,
    manifest,
    recording,
    scales,
    tied,
)

from insenv.core.errors import InputError
from insenv.data.manifest import HeldOut, KnownPositions
from insenv.effects.catalogue import by_key
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes, uncertain_directions
from insenv.identify.positions.accelerometers.trace import uncertain_calibration
from insenv.identify.positions.leave_out import left_out
from insenv.identify.positions.model import Linear, Surroundings, triad_term
from insenv.identify.positions.trace import trace_positions

# ---------------------------------------------------------------------------------------------------------- few rests


#: The telephone read twice a second, for 20 s and for 10 s a face.
SLOW, SHORT = replace(PHONE, rate=2.0, rest_s=20.0), replace(PHONE, rate=2.0, rest_s=10.0)


@pytest.mark.parametrize(
    ("bench", "one_file", "parts"),
    [(NAVIGATION, True, 8), (NAVIGATION, False, 8), (PHONE, True, 8), (SLOW, False, 8), (SHORT, False, 4)],
)
def test_the_six_position_test_runs_as_it_is_and_agrees_with_the_textbook(
    bench: Bench, one_file: bool, parts: int
) -> None:
    """Bias within 0.3 mm/s^2 and scale factor within 30 ppm of twelve parameters by least squares, navigation grade.

    The phone lies level within 0.6 deg: the textbook takes the faces for exact, the magnitude of gravity does not.
    """
    runs = faces(bench, 1, one_file)
    model = replace(manifest(ACCELS, CALIBRATED, HeldOut()), runs=(None,) * len(runs))  # type: ignore[arg-type]
    found = trace_positions(model, runs)
    assert found.remarks[0].startswith("6 rests") and f"each cut into {parts} parts" in found.remarks[0]
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
        width = np.sqrt(np.sum(uncertain_calibration(found.accel, problem.measured, problem.around) ** 2, axis=(1, 2)))
        assert np.all(width > 1e-5)  # 1 mm/s^2 of scatter, and coefficients that nothing tells


# ---------------------------------------------------------------------------------------------------- known attitudes


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
