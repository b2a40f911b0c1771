"""Generalised least squares in the DCT-II domain: against the dense one, priors, several runs, z-scores."""

from dataclasses import replace

import numpy as np
import pytest
from fit_cases import covariance, problem_of, terms
from motions import edges
from numpy.testing import assert_allclose
from scipy.stats import chi2
from simulated_runs import DEG_PER_HOUR, KINDS, gyro_run

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.effects.catalogue import by_key
from insenv.identify.fit.gls import Fit, coefficients, solve
from insenv.identify.fit.problem import Problem, Term, design

#: Powers of white noise, flicker, random walk and quantisation.
ONLY_WHITE_AND_WALK = np.array([(0.5 * DEG_PER_HOUR) ** 2, 0.0, (0.02 * DEG_PER_HOUR) ** 2, 0.0])


def named(fit: Fit) -> dict[str, tuple[float, float]]:
    """Value and standard deviation of the model's parameters, by name; free bins are none of them."""
    rows = zip(fit.design.labels, fit.theta, fit.sd, fit.design.term, strict=True)
    return {f"{key}.{name}": (value, sd) for (key, name, _), value, sd, term in rows if term >= 0}


def fitted_bins(problem: Problem, columns: Floats) -> Floats:
    return np.concatenate([columns[b.start : b.stop] for b in problem.fitted])


def test_estimates_are_those_of_the_dense_covariance() -> None:
    """White noise and random walk with a diffuse bias: values and standard deviations to 1e-5."""
    problem, _ = problem_of(gyro_run("staircase", 1, duration=600.0).recording, averaging=2.0)
    model = terms("bias", "scale_factor", "bias_temperature:1", "angle_locked_rate:1")
    columns = design(problem, model)
    beta, cov = coefficients(problem, columns, ONLY_WHITE_AND_WALK)
    x, y = fitted_bins(problem, columns.matrix), fitted_bins(problem, problem.y)
    assert len(y) == 179
    inverse = np.linalg.inv(covariance(len(y), ONLY_WHITE_AND_WALK[0], ONLY_WHITE_AND_WALK[2]))
    information = x.T @ inverse @ x + np.diag(columns.prior)
    dense = np.linalg.solve(information, x.T @ inverse @ y)
    dense_sd, sd = (np.sqrt(np.diag(c)) for c in (np.linalg.inv(information), cov))
    # The bias is the level of a walk that started anywhere: only what lies beside it is comparable.
    beside = columns.term > 0
    assert beside.sum() == 4
    assert np.all(np.abs(beta - dense)[beside] < 1e-5 * dense_sd[beside])
    assert_allclose(sd[beside], dense_sd[beside], rtol=1e-5)


def test_collinear_columns_are_dropped_and_named() -> None:
    run = gyro_run("constant", 2, duration=600.0)
    problem, _ = problem_of(run.recording)
    fit = solve(problem, terms("bias", "angle_locked_rate:1", "earth_rate", "bias_drift", "bias_drift"))
    assert {key for key, _ in fit.design.dropped} == {"earth_rate", "bias_drift"}
    assert list(named(fit)) == ["bias.c", "angle_locked_rate:1.c", "angle_locked_rate:1.s", "bias_drift.c"]
    once = solve(problem, terms("bias", "angle_locked_rate:1", "bias_drift"))
    assert_allclose(fit.predicted(), once.predicted(), rtol=1e-9)


def test_an_empty_model_foretells_nothing() -> None:
    problem, _ = problem_of(gyro_run("rest", 2, duration=600.0).recording, declared=("bias",))
    fit = solve(problem, ())
    assert named(fit) == {}
    assert not fit.predicted()[problem.bins.held_out].any()


def test_the_prior_acts_on_what_the_data_do_not_tell() -> None:
    """A rate of 1e-9 rad/s tells no scale factor: the prior rules. At 0.3 rad/s the data do."""
    t = edges(6000, 0.1)[1:]
    rng = np.random.default_rng(1)
    prior = by_key("scale_factor").linear[0].bound
    for size, told in ((1e-9, False), (0.3, True)):
        rate = size * np.sign(np.sin(0.05 * t))
        y = rate * (1 + 5 * prior) + 1e-5 * rng.standard_normal(len(t))
        channels = {"gyro": Channel(y, "rad/s", "interval"), "table_rate": Channel(rate, "rad/s", "interval")}
        problem, _ = problem_of(Recording(t, channels))
        fit = solve(problem, terms("bias", "scale_factor"))
        value, sd = named(fit)["scale_factor.c"]
        if told:
            assert sd < 0.01 * prior
            # A gain of 3.5 is no small error: the fit is relative to it.
            assert problem.gain * (1 + value) - 1 == pytest.approx(5 * prior, rel=0.01)
        else:
            assert sd == pytest.approx(prior, rel=1e-3)
            assert abs(value) < 0.1 * prior


def test_a_fit_in_any_unit_is_the_same_fit() -> None:
    """Data ten times as large have residuals and bias ten times as large, where no prior acts."""
    r = gyro_run("rest", 3, duration=600.0).recording
    fits = []
    for factor in (1.0, 10.0):
        channels = {"gyro": replace(r.channels["gyro"], values=factor * r.channels["gyro"].values)}
        problem, model = problem_of(replace(r, channels=channels), declared=("bias",))
        fits.append(solve(problem, model))
    small, large = (named(fit)["bias.c"] for fit in fits)
    assert large[0] == pytest.approx(10 * small[0], rel=1e-6)
    assert large[1] == pytest.approx(10 * small[1], rel=1e-2)


def two_positions(
    seed: int, bias: float, scale: float, biases: tuple[float, float] = (0.0, 0.0)
) -> tuple[Recording, ...]:
    """A gyro at rest with its input axis up, then down, at 45 degrees north; 10 min each."""
    rng = np.random.default_rng(seed)
    vertical = EARTH_RATE * np.sin(np.pi / 4)
    t = edges(3000, 0.2)[1:]
    runs = []
    for sign, own in zip((1, -1), biases, strict=True):
        white = 0.3 * DEG_PER_HOUR / np.sqrt(0.2) * rng.standard_normal(len(t))
        y = bias + own + (1 + scale) * sign * vertical + white
        channels = {"gyro": Channel(y, "rad/s", "interval")}
        runs.append(
            Recording(t, channels, site=Site(np.pi / 4), mounting=Mounting(sign * np.pi / 2), label=f"{sign:+d}")
        )
    return tuple(runs)


def test_two_positions_separate_bias_and_scale_factor() -> None:
    """False alarm: 40 chi-square deviates each, 1e-6 either side, two parameters: 4e-6."""
    z = []
    for seed in range(40):
        bias, scale = 2 * DEG_PER_HOUR, 0.02
        problem, model = problem_of(
            *two_positions(seed, bias, scale), declared=("bias", "scale_factor", "earth_rate"), bias="common"
        )
        found = named(solve(problem, model))
        values = [v for key, v in found.items() if key.startswith(("bias", "scale_factor"))]
        assert len(found) == 2, list(found)
        z.append([(value - truth) / sd for (value, sd), truth in zip(values, (bias, scale), strict=True)])
    total = np.sum(np.square(z), axis=0)
    assert np.all(total < chi2.ppf(1 - 1e-6, 40)), total / 40
    # The level of a stretch of noise is weighted with some caution: not by more than a factor of two.
    assert np.all(total > 0.25 * chi2.ppf(1e-6, 40)), total / 40


def test_a_bias_of_each_run_is_found_and_one_position_tells_no_scale_factor() -> None:
    own = (1 * DEG_PER_HOUR, -3 * DEG_PER_HOUR)
    problem, model = problem_of(*two_positions(1, 0.0, 0.0, own), declared=("bias", "earth_rate"), bias="per-run")
    fit = solve(problem, model)
    values = [v for label, v in zip(fit.design.labels, fit.theta, strict=True) if label[0] == "bias"]
    # White noise of 0.3 deg/h sqrt(s) over 360 s: four standard deviations.
    assert_allclose(values, own, rtol=0, atol=4 * 0.3 * DEG_PER_HOUR / np.sqrt(360))


def test_runs_with_biases_of_their_own_share_the_scale_factor() -> None:
    runs = [gyro_run("staircase", seed, duration=600.0) for seed in (5, 6)]
    moved = []
    for run in runs:  # the same scale factor in both
        gyro = run.recording.channels["gyro"]
        values = gyro.values + (2e-4 - run.own["scale_factor"]) * run.motion.rate
        moved.append(replace(run.recording, channels={**run.recording.channels, "gyro": replace(gyro, values=values)}))
    problem, model = problem_of(*moved)
    found = named(solve(problem, model))
    assert sorted(found) == ["bias.c[1]", "bias.c[2]", "scale_factor.c"]
    biases = [found[key] for key in sorted(found) if key.startswith("bias")]
    for (value, sd), run in zip(biases, runs, strict=True):
        assert abs(value - run.own["bias"]) < 5 * sd + 1 * DEG_PER_HOUR
    scale, sd = next(v for key, v in found.items() if key.startswith("scale"))
    alone = [named(solve(*problem_of(r))) for r in moved]
    sds = [next(v for key, v in a.items() if key.startswith("scale"))[1] for a in alone]
    assert abs(scale - 2e-4) < 5 * sd
    assert 0.7 * np.sum(np.array(sds) ** -2.0) ** -0.5 < sd < min(sds)


#: Runs whose scale factor is looked at, and of these the ones that further effects are fitted to, with the widest
#: spread that their deviates may have.
SCATTERED, FURTHER = 220, 120
WIDEST = {"bias_drift": 1.5, "encoder_harmonic:1": 1.25, "scale_factor_cubic": 1.25}


@pytest.fixture(scope="module")
def deviates() -> dict[str, list[float]]:
    """Estimates less the truth, in their standard deviations, over runs of mixed profiles."""
    z: dict[str, list[float]] = {"scale_factor": [], **{key: [] for key in WIDEST}}
    for seed in range(SCATTERED):
        run = gyro_run(("staircase", "reversal", "sine")[seed % 3], 5000 + seed, duration=900.0, dt=0.2)
        problem, model = problem_of(run.recording, averaging=1.0, samples=False)
        value, sd = next(v for key, v in named(solve(problem, model)).items() if key.startswith("scale"))
        z["scale_factor"].append((value - run.own["scale_factor"]) / sd)
        for key in WIDEST if seed < FURTHER else ():
            fit = solve(problem, terms("bias", "scale_factor", key))
            if fit.design.labels[-1][0] == key:
                z[key].append(float(fit.theta[-1] / fit.sd[-1]))
    return z


@pytest.mark.slow
def test_estimates_scatter_as_their_standard_deviations_say(deviates: dict[str, list[float]]) -> None:
    """z-scores of the scale factor over 220 runs of mixed profiles: spread 1 +- 0.15.

    The spread of 220 normal deviates has a standard deviation of 0.048: false alarm 2e-3.
    """
    z = deviates["scale_factor"]
    assert np.std(z) == pytest.approx(1, abs=0.15)
    assert abs(np.mean(z)) < 0.2  # 3 standard deviations


@pytest.mark.slow
def test_further_coefficients_scatter_as_their_standard_deviations_say(deviates: dict[str, list[float]]) -> None:
    """As above for a slow, an angle-locked and a rate-dependent effect; 3 x 120 deviates, false alarm 1e-3.

    A slow effect lives in the few modes where the noise is hardest to know: the standard deviation of a fit,
    which takes the fitted noise for the true one, is too small there (1.3; with the true noise it is 1.0).
    """
    for key, most in WIDEST.items():
        assert len(deviates[key]) >= 100, key
        assert 0.75 < np.std(deviates[key]) < most, (key, np.std(deviates[key]))


def test_the_profiles_are_what_they_are_called() -> None:
    """Each kind turns, stands or reverses as its name says: the tests above mean what they say."""
    rates = {kind: gyro_run(kind, 1, duration=600.0).motion.rate for kind in KINDS}
    assert np.ptp(rates["constant"]) < 1e-12 < rates["constant"].max()
    assert not rates["rest"].any()
    assert len(np.unique(np.round(rates["staircase"], 9))) > 10
    for kind in ("reversal", "sine", "staircase"):
        assert rates[kind].min() < 0 < rates[kind].max()


def test_a_run_that_stands_still_where_it_is_fitted_has_the_skew_of_the_others() -> None:
    """The second run moves in its held-out part alone; of no skew there the whole of it would be left."""
    t, rng, runs = edges(6000, 0.1)[1:], np.random.default_rng(6), []
    rate, late = 0.3 * np.sin(0.5 * t), 0.3 * np.sin(0.5 * (t - 0.02))
    for start in (0.0, 400.0):
        y = np.where(t > start, late, 0.0) + 1e-5 * rng.standard_normal(len(t))
        table = np.where(t > start, rate, 0.0)
        channels = {"gyro": Channel(y, "rad/s", "interval"), "table_rate": Channel(table, "rad/s", "interval")}
        runs.append(Recording(t, channels))
    problem, model = problem_of(*runs, averaging=1.0)
    fit = solve(problem, (*model, Term(by_key("timing_skew"), per_run=True)))
    later = problem.bins.held_out & (problem.bins.run == 1) & (problem.bins.time > 410)
    left = (problem.y - fit.predicted())[later]
    assert np.std(left) < 0.05 * np.std(problem.y[later])
