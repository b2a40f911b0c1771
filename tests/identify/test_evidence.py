"""How sure: the held-out deviate, and how it is joined to the fitted evidence."""

import numpy as np
import pytest
from scipy.stats import norm
from simulated_runs import Simulated, declared_for, gyro_run, manifest, scaled, use

from insenv.effects.catalogue import by_key
from insenv.identify.fit.evidence import held_out_deviate, joint_deviate, log_tail
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import Score, confirms, held_out_score, rescored, residual
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.round import with_term
from insenv.identify.search.scan import reference, term_freedom

KEYS = ("bias_drift", "bias_temperature:1", "angle_locked_rate:1", "scale_factor_cubic")


def declared(run: Simulated) -> tuple[Problem, Fit]:
    """The bins and the declared model's fit."""
    recording = run.recording
    asked = manifest(declared=declared_for(recording), averaging=1.0)
    prepared = prepare(asked, (recording,), (use(len(recording)),), "gyro")
    return prepared.problem, solve(prepared.problem, prepared.model)


def deviate(problem: Problem, small: Fit, key: str) -> tuple[float, float]:
    """The held-out deviate of one effect beside the declared model, and its information."""
    term = Term(by_key(key))
    large = solve(problem, with_term(small.model, term), start=small.noise.power)
    freedom = term_freedom(problem, reference(problem, small.model, small.noise.power), term)
    return held_out_deviate(problem, small, large, freedom)


@pytest.fixture(scope="module")
def complete() -> list[tuple[Problem, Fit]]:
    """100 runs that the declared model explains."""
    kinds = ("staircase", "reversal", "sine")
    return [declared(gyro_run(kinds[seed % 3], 8000 + seed, duration=900.0)) for seed in range(100)]


@pytest.mark.slow
@pytest.mark.parametrize("key", KEYS)
def test_held_out_deviates_of_no_effect_are_no_larger_than_normal_ones(
    key: str, complete: list[tuple[Problem, Fit]]
) -> None:
    """Over 100 runs: spread below 1.25 (3.5 standard deviations of it above 1) and mean within 0.4."""
    z = [deviate(*one, key)[0] for one in complete]
    assert np.sqrt(np.mean(np.square(z))) < 1.25
    assert np.std(z) > 0.5  # not damped away
    assert abs(np.mean(z)) < 0.4


def test_held_out_data_confirm_what_is_there_and_refute_what_has_gone() -> None:
    theta = np.array([1.0])
    bare = gyro_run("sine", 41, duration=900.0)
    size = scaled(bare, "scale_factor_cubic", theta, 25)
    run = gyro_run("sine", 41, (("scale_factor_cubic", size),), duration=900.0)
    z, information = deviate(*declared(run), "scale_factor_cubic")
    assert z > 4
    assert information > 20
    gone = run.recording.channels["gyro"].values.copy()
    n = len(gone)
    effect = by_key("scale_factor_cubic").apply(run.motion.rate, run.motion, size)[0]
    gone[use(n).held_out] -= 2 * effect[use(n).held_out]  # it has changed its sign
    run.recording.channels["gyro"].values[:] = gone
    assert deviate(*declared(run), "scale_factor_cubic")[0] < -4


def test_deviates_are_joined_by_their_information() -> None:
    """Equal information: the sum over root two. None held out: the fitted one alone."""
    for z_fit, z_held in ((3.0, 2.0), (5.0, -1.0), (0.5, 4.0)):
        log_p = float(norm.logsf(z_fit))
        assert joint_deviate(log_p, 10.0, z_held, 10.0) == pytest.approx((z_fit + z_held) / np.sqrt(2))
        assert joint_deviate(log_p, 10.0, z_held, 0.0) == pytest.approx(z_fit)
        assert joint_deviate(log_p, 10.0, z_held, 40.0) == pytest.approx((z_fit + 2 * z_held) / np.sqrt(5))


def test_the_joint_deviate_of_two_normal_ones_is_normal() -> None:
    """20 000 pairs: Kolmogorov's distance below 0.0153, false alarm 2e-4."""
    rng = np.random.default_rng(5)
    pairs = rng.standard_normal((20_000, 2))
    joined = [joint_deviate(float(norm.logsf(a)), 7.0, b, 3.0) for a, b in pairs]
    # A fitted deviate is never below that of p = 1 - 1e-12.
    distance = np.abs(norm.cdf(np.sort(joined)) - (np.arange(20_000) + 0.5) / 20_000).max()
    assert distance < 0.0153


@pytest.mark.parametrize("z", [-3.0, 0.0, 2.0, 8.0, 50.0])
def test_tails_stay_finite(z: float) -> None:
    assert log_tail(z) == pytest.approx(norm.logsf(z), rel=1e-9)


def test_the_held_out_score_is_that_of_the_residual() -> None:
    run = gyro_run("rest", 42, duration=900.0)
    prepared = prepare(manifest(declared=("bias",)), (run.recording,), (use(len(run.recording)),), "gyro")
    problem, fit = prepared.problem, solve(prepared.problem, prepared.model)
    score = held_out_score(problem, fit)
    left = residual(problem, fit)[problem.bins.held_out]
    assert score.rms == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-12)
    # Noise alone: the sum of m squared deviates; the noise is known to a few per cent.
    assert score.whitened == pytest.approx(len(left), rel=5 * np.sqrt(2 / len(left)) + 0.1)
    louder = rescored(problem, fit, 4 * fit.noise.power)
    assert louder.whitened == pytest.approx(score.whitened / 4, rel=1e-9)
    assert louder.rms == score.rms


def test_what_makes_both_measures_worse_is_refused() -> None:
    before = Score(1.0, 0.5, 100.0)
    assert confirms(before, Score(0.9, 0.5, 90.0), before)
    assert not confirms(before, Score(1.2, 0.5, 120.0), before)
