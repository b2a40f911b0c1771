"""How sure: the held-out deviate, and how it is joined to the fitted evidence."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student
from simulated_runs import Simulated, declared_for, gyro_run, manifest, scaled, use

from insenv.core.recording import Floats
from insenv.effects.catalogue import by_key
from insenv.identify.fit.evidence import (
    HELD_OUT_SPREAD,
    held_out_deviate,
    held_out_information,
    held_out_modes,
    joint_deviate,
    log_tail,
)
from insenv.identify.fit.gls import Fit, coefficients, noise_freedom, solve
from insenv.identify.fit.heldout import Score, confirms, held_out_score, rescored, residual
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.round import with_term
from insenv.identify.search.scan import reference, term_freedom

KEYS = ("bias_drift", "bias_temperature:1", "angle_locked_rate:1", "scale_factor_cubic")


def declared(run: Simulated, samples: bool = True) -> tuple[Problem, Fit]:
    """The bins and the declared model's fit, with holds and lines looked for in the samples or not."""
    recording = run.recording
    asked = manifest(declared=declared_for(recording), averaging=1.0)
    prepared = prepare(asked, (recording,), (use(len(recording)),), "gyro", samples, samples)
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
    runs = (gyro_run(kinds[seed % 3], 8000 + seed, duration=900.0, dt=0.2) for seed in range(100))
    return [declared(run, samples=False) for run in runs]


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
    gyro = replace(run.recording.channels["gyro"], values=gone)
    run = replace(run, recording=replace(run.recording, channels={**run.recording.channels, "gyro": gyro}))
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
    before = Score(1.0, 0.5, 100.0, 0.5, 0.5)
    assert confirms(before, Score(0.9, 0.5, 90.0, 0.5, 0.5), before)
    assert not confirms(before, Score(1.2, 0.5, 120.0, 0.5, 0.5), before)
    # A little worse by the plain measure is chance where the whitened one gets better.
    assert confirms(before, Score(1.015, 0.5, 90.0, 0.5, 0.5), before)
    assert not confirms(before, Score(1.015, 0.5, 110.0, 0.5, 0.5), before)
    assert not confirms(before, Score(1.025, 0.5, 90.0, 0.5, 0.5), before)


#: Variance of a bin, of white noise alone.
WHITE = 4e-10


@pytest.fixture(scope="module")
def white() -> tuple[Problem, Fit, Fit]:
    """A run with a held-out end, the declared model and one with a drift, with white noise of known power."""
    problem, small = declared(gyro_run("staircase", 77, duration=900.0))
    power = np.zeros(len(small.noise.power))
    power[0] = WHITE * problem.bins.width
    large = solve(problem, with_term(small.model, Term(by_key("bias_drift"))))
    return problem, with_power(problem, small, power), with_power(problem, large, power)


def with_power(problem: Problem, fit: Fit, power: Floats) -> Fit:
    beta, cov = coefficients(problem, fit.design, power)
    return replace(fit, beta=beta, cov=cov, noise=replace(fit.noise, power=power))


def dense(problem: Problem, fit: Fit) -> tuple[Floats, Floats]:
    """Of white noise: matrix that takes bins to held-out bins beside the level of the block before, and covariance."""
    rows, noise = [], []
    blocks = problem.bins.blocks
    for before, block in zip(blocks[:-1], blocks[1:], strict=True):
        if block.fitted:
            continue
        beside = np.zeros((block.n, problem.bins.n))
        beside[:, block.start : block.stop] = np.eye(block.n)
        beside[:, before.start : before.stop] = -1 / before.n
        rows.append(beside)
        noise.append(WHITE * (np.eye(block.n) + 1 / before.n))
    assert len(rows) == 1
    x = rows[0] @ fit.design.matrix
    return rows[0], noise[0] + x @ fit.cov @ x.T


def test_the_held_out_deviate_is_that_of_the_dense_covariance(white: tuple[Problem, Fit, Fit]) -> None:
    """Two ways of computing, V = S + X cov X': white noise, to 1e-6."""
    problem, small, large = white
    take, v = dense(problem, small)
    r, moved = take @ residual(problem, small), take @ (residual(problem, small) - residual(problem, large))
    asked = np.linalg.solve(v, moved)
    z, information = held_out_deviate(problem, small, large, 1e9)
    assert information == pytest.approx(moved @ asked, rel=1e-6)
    assert z == pytest.approx(r @ asked / np.sqrt(moved @ asked) / HELD_OUT_SPREAD, rel=1e-6)
    change = residual(problem, small) - residual(problem, large)
    assert held_out_information(problem, small, change) == pytest.approx(information, rel=1e-9)
    _, modes = held_out_modes(problem, small)
    assert modes @ modes == pytest.approx(r @ np.linalg.solve(v, r), rel=1e-6)


def test_the_held_out_deviate_is_as_unlikely_as_students(white: tuple[Problem, Fit, Fit]) -> None:
    problem, small, large = white
    known, _ = held_out_deviate(problem, small, large, 1e12)
    few, _ = held_out_deviate(problem, small, large, 5.0)
    assert norm.sf(few) == pytest.approx(student.sf(known, 5.0), rel=1e-9)


def test_what_moves_no_held_out_bin_tells_nothing(white: tuple[Problem, Fit, Fit]) -> None:
    problem, small, _ = white
    assert held_out_deviate(problem, small, small, 1e9) == (0.0, 0.0)


def test_noise_is_known_as_well_as_the_modes_that_show_it() -> None:
    """One power of n modes: var(log S) = 2 / n. Of noise that wanders, slow modes know less than fast ones."""
    problem, fit = declared(gyro_run("staircase", 77, duration=900.0))
    n = len(problem.modes().shapes)
    flat = np.ones(n)
    only = replace(problem, most=np.array([np.inf, 0.0, 0.0, 0.0]))
    assert noise_freedom(only, fit.noise.power, flat) == pytest.approx(n, rel=1e-6)
    both, power = replace(problem, most=np.array([np.inf, 0.0, np.inf, 0.0])), np.full(4, WHITE)
    order = np.argsort(problem.modes().lam)
    slow, fast = np.zeros(n), np.zeros(n)
    slow[order[:5]], fast[order[-50:]] = 1.0, 1.0
    assert noise_freedom(both, power, slow) < 0.5 * noise_freedom(both, power, fast) < 0.5 * n
