"""North by generalised least squares: exact without noise, honest with it, and free of what a reversal shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from north_cases import (
    LATITUDE,
    PULSE,
    RATE,
    TILT,
    Case,
    azimuths,
    joined,
    piece,
    play,
    played,
    row,
    there_and_back,
    wrapped,
)
from scipy.linalg import solveh_banded

from estimators.common.rate_policies import Bidirectional, ConstantRate
from estimators.north_finder.gls import CIRCLE, GlsState, NorthGls
from insenv.core.errors import InputError
from insenv.core.estimate import Declared, Estimate
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Floats, Recording
from insenv.core.rows import rows
from insenv.core.units import ARCSEC, DEG, PPM
from insenv.effects.angle import EarthRate, EncoderHarmonic
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.fisher import IncrementNoise, information, north_bound
from insenv.information.polynomial import BiasPolynomial, ScaleFactorPolynomial
from insenv.information.rate_noise import misfit, pulses
from insenv.plants.profile import Piece, constant
from insenv.plants.turntable import Turntable
from insenv.scenario import datasheet, load
from insenv.sensors.chain import Sensor
from insenv.systems.north_finder.scale_factor import scale_factor

BOTH = Case(acceleration=20 * DEG, profile=there_and_back())
#: Half of the samples, in long steps: what is believed is of what was recorded.
SLOW = {"instrument.sampling": "50 Hz", "task.step": "5 s"}
QUIET = {"walk": 0.0, "pulse": 0.0}
#: Warm-up by 100 ppm in the first hour.
WARM = ("scale_factor_warm_up", (-100 * PPM / (1 - np.exp(-3600 / 850)), 850.0))


def found(case: Case, recording: Recording, **settings: float) -> Estimate:
    """Estimate of a batch in one chunk."""
    estimator = NorthGls(case.datasheet(), **settings)  # type: ignore[arg-type]
    return estimator.estimate(estimator.update(estimator.reset(len(recording.values("gyro", "rad/s"))), recording))


def errors(case: Case, azimuth: Floats, seed: int = 0, **settings: float) -> tuple[Floats, Floats]:
    """Errors of the azimuth and their standard deviations [arcsec]."""
    mean, sd = found(case, case.run(azimuth, seed), **settings).of("azimuth")
    return wrapped(mean - azimuth) / ARCSEC, sd / ARCSEC


def rms(x: Floats) -> float:
    return float(np.sqrt(np.mean(x * x)))


def declared(key: str, mean: tuple[float, ...], sd: tuple[float, ...]) -> tuple[Declared, ...]:
    return (Declared(key, "gyro", mean, sd),)


def same(a: GlsState, b: GlsState) -> bool:
    return np.array_equal(a.sums, b.sums, equal_nan=True) and np.array_equal(a.normal, b.normal)


def test_it_is_found_by_name() -> None:
    assert find(ESTIMATORS, "north_gls") is NorthGls


RAMP = ("scale_factor_drift", (100 * PPM / 300,))


@pytest.mark.parametrize(
    "case",
    [
        Case(**QUIET),  # type: ignore[arg-type]
        Case(**QUIET, effects=(("scale_factor", (1e-4,)), RAMP)),  # type: ignore[arg-type]
        replace(BOTH, **QUIET),  # type: ignore[arg-type]
        replace(
            BOTH,
            **QUIET,  # type: ignore[arg-type]
            effects=(RAMP, ("bias", (1e-7,)), ("encoder_harmonic:1", (1e-6, 2e-6)), ("encoder_harmonic:3", (5e-6, 0))),
        ),
        Case(**QUIET, sampling=1.0, profile=constant(60 * DEG, np.inf)),  # type: ignore[arg-type]
        Case(**QUIET, profile=constant(-100 * DEG, np.inf), tilt=5 * DEG),  # type: ignore[arg-type]
    ],
    ids=["one way", "drifting", "both ways", "both ways, encoder", "1 Hz", "fast"],
)
def test_without_noise_north_is_exact(case: Case) -> None:
    error, _ = errors(case, azimuths(12))
    assert np.abs(error).max() < 1e-6


@pytest.mark.parametrize("m", [1, 2, 10, 20])
def test_differences_of_block_means_have_the_covariance_that_is_whitened(m: int) -> None:
    case = Case(sampling=m / 0.2, encoder_noise=0.3 * ARCSEC)
    estimator = NorthGls(case.datasheet())
    assert estimator.block == m
    dt, share = 0.2 / m, np.sin(TILT)
    n = 4 * m
    sums = np.tril(np.ones((n, n)))
    angle = case.walk**2 * dt * sums @ sums.T + (PULSE**2 / 12 + (share * 0.3 * ARCSEC) ** 2) * np.eye(n)
    means = np.kron(np.eye(4), np.full(m, 1 / m))
    differences = np.diff(means, axis=0)
    expected = differences @ angle @ differences.T
    c0, c1 = estimator._numbers[4:6]
    np.testing.assert_allclose(np.diag(expected), c0, rtol=1e-9)
    np.testing.assert_allclose(np.diag(expected, 1), c1, rtol=1e-9)
    np.testing.assert_allclose(np.diag(expected, 2), 0.0, atol=1e-9 * c0)


def exact_solution(case: Case, recording: Recording, index: int) -> tuple[float, float, float]:
    """Azimuth, its deviation and the bound from the increments themselves with their full covariance."""
    sampling, n = case.sampling, len(recording)
    table = Turntable(tilt=case.tilt, latitude=case.latitude, profile=case.profile)
    scene, _ = table.advance(table.begin(), None, np.arange(n + 1) / sampling, np.zeros((0, n)))
    motion = scene.motions["gyro"]
    sensor = Sensor(
        "gyro",
        (
            EarthRate(),
            ScaleFactorPolynomial(2, case.duration),
            BiasPolynomial(0, case.duration),
            *map(EncoderHarmonic, (2, 3, 4)),
        ),
    )
    prior = np.array([0, 0, *3 * [1e-2**-2], 1e-4**-2.0, *6 * [1e-4**-2.0]])
    noise = IncrementNoise(case.walk, case.pulse / 12**0.5)
    x = sensor.regressors(motion, np.zeros(len(prior))) * motion.dt
    y = (recording.values("gyro", "rad/s")[index] - motion.rate) * motion.dt
    weighed = solveh_banded(noise.banded(n, motion.dt), np.column_stack([x, y]))
    matrix = x.T @ weighed[:, :-1] + np.diag(prior)
    scale = 1 / np.sqrt(np.diag(matrix))
    solution = scale * np.linalg.solve(matrix * np.outer(scale, scale), scale * (x.T @ weighed[:, -1]))
    azimuth = float(np.arctan2(solution[1], solution[0]))
    priors = dict(zip(sensor.names[2:], prior[2:] ** -0.5, strict=True))
    bound = information(motion, sensor, noise).given(priors).bound()
    return azimuth, north_bound(bound, case.level, azimuth), north_bound(bound, case.level)


def test_it_equals_least_squares_on_all_samples_within_what_blocks_lose() -> None:
    case, azimuth = Case(), azimuths(4)
    recording = case.run(azimuth)
    mean, sd = found(case, recording).of("azimuth")
    # There pulses are a white error of the angle; what they have at one cycle a turn is told besides.
    beyond = (pulses(case.datasheet(), RATE) - 1) * PULSE**2 / 12 * RATE**2 / case.sampling
    sd = np.sqrt(sd**2 - 2 * beyond / (case.duration * case.level**2))
    for i in range(4):
        exact, deviation, bound = exact_solution(case, recording, i)
        # What is lost of the information differs at random: by sqrt(2 * 0.4 %) of a deviation.
        assert abs(wrapped(mean[i] - exact)) < 0.09 * deviation
        assert deviation <= sd[i] * (1 + 1e-6) and sd[i] < 1.004 * deviation
        assert bound / ARCSEC == pytest.approx(31.0, abs=0.4)


def test_chunks_make_no_difference() -> None:
    case = replace(BOTH, duration=40.0, profile=there_and_back(at=20.0), encoder_noise=0.1 * ARCSEC)
    recording = case.run(azimuths(3))
    estimator = NorthGls(case.datasheet())
    whole = estimator.update(estimator.reset(3), recording)
    for size in (1, 7, 100, 333):
        state = estimator.reset(3)
        for start in range(0, len(recording), size):
            state = estimator.update(state, piece(recording, start, start + size))
        assert same(state, whole)


def test_a_row_of_a_batch_is_the_single_run() -> None:
    recording, estimator = BOTH.run(azimuths(3)), NorthGls(BOTH.datasheet())
    batch = estimator.update(estimator.reset(3), recording)
    told = estimator.estimate(batch)
    for i in range(3):
        alone = estimator.update(estimator.reset(), row(recording, i))
        taken = rows(batch, np.array([i]))
        assert np.array_equal(taken.normal[0], alone.normal)
        single = estimator.estimate(alone)
        assert single.mean.shape == (2,) and single.cov.shape == (2, 2)
        assert np.array_equal(single.mean, told.mean[i]) and np.array_equal(single.cov, told.cov[i])


def test_an_update_leaves_the_state_before_it_as_it_was() -> None:
    recording, estimator = Case(duration=2.0).run(azimuths(2)), NorthGls(Case().datasheet())
    before = estimator.reset(2)
    estimator.update(before, recording)
    assert same(before, estimator.reset(2))


@pytest.mark.parametrize(
    "case",
    [
        Case(profile=constant(0.0, np.inf), duration=30.0),
        Case(latitude=np.pi / 2, duration=60.0),
        Case(tilt=np.pi / 2, duration=60.0),
        Case(duration=0.1),
        Case(duration=5.0),
    ],
    ids=["at rest", "at the pole", "axis upright", "hardly begun", "an eighth of a turn"],
)
def test_where_nothing_is_told_of_north_the_answer_is_the_prior(case: Case) -> None:
    estimate = found(case, case.run(azimuths(2)))
    mean, sd = estimate.of("azimuth")
    assert np.array_equal(mean, np.zeros(2)) and sd == pytest.approx(np.sqrt(CIRCLE))
    assert np.isfinite(estimate.cov).all()


def test_before_any_data_the_answer_is_the_prior() -> None:
    estimator = NorthGls(Case().datasheet())
    for batch, shape in ((None, (2,)), (3, (3, 2))):
        estimate = estimator.estimate(estimator.reset(batch))
        assert estimate.mean.shape == shape and not estimate.mean.any()
        assert estimate.sd[..., 0] == pytest.approx(np.sqrt(CIRCLE))


def test_the_belief_is_never_wider_than_the_prior_and_ends_at_the_bound() -> None:
    case, estimator = Case(), NorthGls(Case().datasheet())
    recording, state, sd = case.run(azimuths(1)), None, []
    state = estimator.reset(1)
    for start in range(0, len(recording), 100):
        state = estimator.update(state, piece(recording, start, start + 100))
        sd.append(estimator.estimate(state).sd[0, 0])
    assert max(sd) <= np.sqrt(CIRCLE) and sd[-1] / ARCSEC == pytest.approx(30.8, abs=0.5)


def test_an_encoder_that_is_declared_uncertain_is_believed_in_one_direction_and_freed_by_a_reversal() -> None:
    e = 0.02 * ARCSEC
    told = declared("encoder_harmonic:1", (0.0, 0.0), (e, e))
    azimuth = azimuths(6)
    leverage = np.sin(TILT) * RATE / Case().level
    one, plain = (errors(replace(Case(), declared=d), azimuth)[1] for d in (told, ()))
    np.testing.assert_allclose(one, np.hypot(plain, e * leverage / ARCSEC), rtol=1e-3)
    both, free = (errors(replace(BOTH, declared=d), azimuth)[1] for d in (told, ()))
    np.testing.assert_allclose(both, free, rtol=2e-3)


def test_an_encoder_error_that_nobody_declared_shifts_one_direction_and_not_both() -> None:
    azimuth = azimuths(24)
    planted = (("encoder_harmonic:1", (0.06 * ARCSEC, 0.08 * ARCSEC)),)
    one = errors(Case(**QUIET, effects=planted), azimuth)[0]  # type: ignore[arg-type]
    both = errors(replace(BOTH, **QUIET, effects=planted), azimuth)[0]  # type: ignore[arg-type]
    # Over all azimuths the shift is a sine of amplitude 180 arcsec.
    assert 150 < np.abs(one).max() < 182
    assert np.abs(both).max() < 0.1


def test_a_reversal_costs_less_than_two_percent() -> None:
    # The table starts from rest in both.
    azimuth = azimuths(64)
    rest = replace(BOTH, profile=(Piece(1e-9, 0.0), Piece(np.inf, RATE)))
    one, both = rms(errors(rest, azimuth)[1]), rms(errors(BOTH, azimuth)[1])
    assert both < 1.02 * one


def test_an_undeclared_encoder_is_freed_only_when_it_is_cheap() -> None:
    case = replace(BOTH, profile=there_and_back(at=280.0))
    azimuth = azimuths(4)
    held, free = (errors(case, azimuth, price=price)[1] for price in (1.25, 100.0))
    assert (held < 32).all() and (free > 1.25 * held).all()


def test_a_gap_ends_a_chain_and_does_no_harm() -> None:
    case = Case(**QUIET)  # type: ignore[arg-type]
    azimuth = azimuths(3)
    whole = case.run(azimuth)
    with_gap = joined([piece(whole, 0, 12345), piece(whole, 13337, 30000)])
    mean, _ = found(case, with_gap).of("azimuth")
    assert np.abs(wrapped(mean - azimuth)).max() / ARCSEC < 1e-6


def test_what_lock_in_does_while_the_table_turns_over_is_left_out() -> None:
    lock_in = ("lock_in", ((0.05 * DEG) ** 2,))
    azimuth = azimuths(8)
    error, _ = errors(replace(BOTH, **QUIET, effects=(lock_in,)), azimuth)  # type: ignore[arg-type]
    assert np.abs(error).max() < 0.01


def test_a_declared_lock_in_is_taken_out_where_the_rate_ripples() -> None:
    square = (0.05 * DEG) ** 2
    case = Case(**QUIET, effects=(("lock_in", (square,)),), ripple=1e-3)  # type: ignore[arg-type]
    azimuth = azimuths(8)
    silent = np.abs(errors(case, azimuth)[0]).max()
    told = replace(case, declared=declared("lock_in", (square,), (0.0,)))
    assert silent > 10 and np.abs(errors(told, azimuth)[0]).max() < 0.02


def test_a_declared_field_is_taken_out_and_its_deviation_told() -> None:
    rate = (2e-8, -1e-8)
    case = Case(**QUIET, effects=(("angle_locked_rate:1", rate),))  # type: ignore[arg-type]
    told = replace(case, declared=declared("angle_locked_rate:1", rate, (1e-8, 1e-8)))
    error, sd = errors(told, azimuths(4))
    assert np.abs(error).max() < 1e-5
    np.testing.assert_allclose(sd, 1e-8 / case.level / ARCSEC, rtol=1e-3)


def test_the_scale_factor_is_that_of_the_present_rate() -> None:
    case = Case(**QUIET, effects=(("scale_factor", (30 * PPM,)), ("bias", (1e-7,))))  # type: ignore[arg-type]
    mean, _ = found(case, case.run(azimuths(1))).of("scale_factor")
    u = RATE * np.sin(TILT) + 7.292115e-5 * np.sin(LATITUDE) * np.sin(TILT)
    assert mean[0] == pytest.approx(30 * PPM + 1e-7 / u, rel=1e-6)


def test_drifts_that_no_polynomial_follows_widen_the_belief() -> None:
    azimuth = azimuths(2)
    walk = 5e-9
    widened = errors(replace(Case(), noise={"rate_random_walk": walk}), azimuth)[1]
    plain = errors(Case(), azimuth)[1]
    extra = np.sqrt(2 / 300) * walk / RATE / Case().level / ARCSEC
    np.testing.assert_allclose(widened, np.hypot(plain, extra), rtol=1e-2)


@pytest.mark.parametrize("present", [1.0, 0.5, 0.2])
@pytest.mark.parametrize("degree", [1, 2])
def test_what_a_polynomial_is_behind_a_walk(degree: int, present: float) -> None:
    n, rng = 500, np.random.default_rng(4)
    x = (np.arange(n) + 0.5) / n
    walk = np.cumsum(rng.standard_normal((4000, n)), axis=1) / np.sqrt(n)
    sense = np.where(x > 1 - present, 1.0, -1.0)
    columns = np.column_stack([*(x**k for k in range(degree + 1)), *([sense] if present < 1 else [])])
    fitted = walk @ np.linalg.pinv(columns).T @ columns[-1]
    assert misfit(present, degree, 0) == pytest.approx(np.var(walk[:, -1] - fitted), rel=0.1)


def test_a_walk_widens_the_scale_factor_at_one_rate_as_well() -> None:
    azimuth, walk = azimuths(2), 1e-8
    widened, plain = (
        found(case, case.run(azimuth, 0)).of(ScaleFactor.id)[1] / PPM
        for case in (replace(Case(), noise={"rate_random_walk": walk}), Case())
    )
    extra = walk / (RATE * np.sin(TILT)) * np.sqrt(300 * misfit(1.0, 2, 0)) / PPM
    assert extra > plain[0]
    np.testing.assert_allclose(widened, np.hypot(plain, extra), rtol=0.03)


def test_impossible_settings_are_refused() -> None:
    sheet = Case().datasheet()
    with pytest.raises(InputError, match="no latitude"):
        NorthGls(replace(sheet, site=replace(sheet.site, latitude=None)))
    with pytest.raises(InputError, match="harmonics from 0 to 4"):
        NorthGls(sheet, harmonics=5)
    with pytest.raises(InputError, match="bias_degree 3"):
        NorthGls(sheet, bias_degree=3)


# Of R runs the spread of z has a standard deviation of 1 / sqrt(2 R), and so has the relative root mean square:
# 4.5 % for 250, 5 % for 200. A limit of 15 % is 3.4 or 3 of them: a right estimator fails with a probability of
# 7e-4, or 3e-3. The seeds are fixed.


@pytest.mark.slow
@pytest.mark.parametrize("change", [0.0, 0.1, 1.0])
def test_it_reaches_the_bound_whatever_the_scale_factor_does(change: float) -> None:
    name, (amplitude, tau) = WARM
    case = Case(effects=((name, (change * amplitude, tau)),))
    error, sd = errors(case, azimuths(250))
    bound = exact_solution(case, case.run(azimuths(1)), 0)[2] / ARCSEC
    assert rms(sd) == pytest.approx(bound, rel=0.01) and rms(sd) == pytest.approx(31.1, rel=0.05)
    assert rms(error) == pytest.approx(bound, rel=0.15)
    assert rms(error / sd) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("policy", [ConstantRate, Bidirectional])
@pytest.mark.parametrize("name", ["published", "realistic"])
def test_the_belief_is_honest(name: str, policy: type[ConstantRate | Bidirectional]) -> None:
    scenario = load(f"north_finder/{name}", SLOW)
    sheet = datasheet(scenario)
    estimator, z = NorthGls(sheet), []
    for first in range(0, 200, 100):
        recording, azimuth = play(scenario, policy(sheet), range(first, first + 100))
        mean, sd = estimator.estimate(estimator.update(estimator.reset(100), recording)).of("azimuth")
        z.append(wrapped(mean - azimuth) / sd)
    assert rms(np.concatenate(z)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("policy", [ConstantRate, Bidirectional])
@pytest.mark.parametrize("rate", [5, 10, 20, 40])
def test_the_belief_of_the_scale_factor_holds_what_the_lock_in_does(
    rate: float, policy: type[ConstantRate | Bidirectional]
) -> None:
    # The deviation was 4 times too small at 5 deg/s, twice at 10 deg/s: a walking threshold was in the azimuth alone.
    scenario = load("north_finder/realistic", SLOW)
    sheet = datasheet(scenario)
    count, estimator = 96, NorthGls(sheet)
    recording, rig, state = played(scenario, policy(sheet, rate * DEG), range(1000, 1000 + count))
    estimate = estimator.estimate(estimator.update(estimator.reset(count), recording))
    sense = np.sign(np.diff(recording.values("table_angle", "rad")[..., -2:])[..., 0])
    u = (sense * rate * DEG + 7.292115e-5 * np.sin(LATITUDE)) * np.sin(sheet.mounting.tilt)
    mean, sd = estimate.of(ScaleFactor.id)
    assert rms((mean - scale_factor(rig, state, np.broadcast_to(u, count), sheet)) / sd) == pytest.approx(1.0, abs=0.22)
    assert isinstance(rig.plant, Turntable)
    mean, sd = estimate.of("azimuth")
    assert rms(wrapped(mean - rig.plant.azimuth) / sd) == pytest.approx(1.0, abs=0.22)
