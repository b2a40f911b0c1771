"""Noise of bin means in the DCT-II domain: likelihood, its gradient, and the coefficients found."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from fit_cases import WIDTH, covariance
from numpy.testing import assert_allclose
from scipy.optimize import check_grad
from scipy.stats import chi2
from simulated_runs import simulated_noise

from insenv.core.recording import Floats
from insenv.effects.noise import AngleRandomWalk, BiasInstability, Quantization, RateRandomWalk
from insenv.identify.fit.bins import Block
from insenv.identify.fit.noise import (
    Pooled,
    eigenvalues,
    fit_noise,
    grouping,
    loglik,
    modes,
    transform,
)

TERMS = (AngleRandomWalk(), BiasInstability(), RateRandomWalk(), Quantization())


def block(n: int, start: int = 0) -> Block:
    return Block(0, True, start, start + n, n)


def regressors(n: int, count: int = 3) -> Floats:
    """A constant, a ramp and slow waves."""
    t = np.linspace(-1, 1, n)
    return np.column_stack([np.ones(n), t, *(np.sin(3 * k * t + k) for k in range(1, count - 1))])[:, :count]


def pooled(blocks: tuple[Block, ...], y: Floats, x: Floats, groups: int = 100) -> Pooled:
    mode = modes(blocks, TERMS, WIDTH)
    return grouping(mode, groups).pool(transform(blocks, np.column_stack([y, x])))


def dense_loglik(y: Floats, x: Floats, v: Floats) -> float:
    """Restricted log-likelihood with the n x n covariance itself."""
    inverse = np.linalg.inv(v)
    information = x.T @ inverse @ x
    residual = y - x @ np.linalg.solve(information, x.T @ inverse @ y)
    logs = np.linalg.slogdet(v)[1] + np.linalg.slogdet(information)[1]
    return float(-0.5 * (logs + residual @ inverse @ residual))


@pytest.mark.parametrize("gone", range(4))
@pytest.mark.parametrize("true", range(4))
def test_noise_that_must_be_nothing_leaves_the_best_of_the_others(gone: int, true: int) -> None:
    """As if it had never been there, whatever it would have explained: two ways of computing, to a thousandth."""
    n, rng = 60, np.random.default_rng([gone, true])
    y = simulated_noise({TERMS[true].id: 1.0}, n, WIDTH, rng)
    products = pooled((block(n),), y, regressors(n, 2))
    most = np.where(np.arange(4) == gone, 0.0, np.inf)
    others = replace(products, shapes=np.delete(products.shapes, gone, axis=1))
    assert_allclose(
        fit_noise(products, np.zeros(2), most=most).loglik, fit_noise(others, np.zeros(2)).loglik, rtol=0, atol=1e-3
    )


@pytest.mark.parametrize("n", [40, 101])
def test_likelihood_of_white_noise_and_random_walk_is_that_of_the_dense_covariance(n: int) -> None:
    """Two ways of computing: differences between noise powers, to 1e-8; the constant is a diffuse bias."""
    rng = np.random.default_rng(n)
    y, x = rng.standard_normal(n).cumsum(), regressors(n, 4)
    # One group for each mode: nothing is pooled.
    one_each = pooled((block(n),), y, x, groups=10**6)
    assert len(one_each.count) == n
    powers = [(1.0, 0.2), (0.3, 0.2), (2.0, 1e-4), (1e-3, 1.0)]
    dct = [loglik(one_each, np.array([w, 0, k, 0]), np.zeros(4), restricted=True)[0] for w, k in powers]
    dense = [dense_loglik(y, x, covariance(n, w, k)) for w, k in powers]
    assert_allclose(np.diff(dct), np.diff(dense), rtol=1e-8, atol=1e-8)
    assert np.ptp(dense) > 10


def test_pooling_costs_little_likelihood() -> None:
    """A hundred groups against one for nearly each of 3000 modes: within 0.05 where the data lie."""
    n, rng = 3000, np.random.default_rng(1)
    y = simulated_noise({"angle_random_walk": 1.0, "rate_random_walk": 0.02}, n, WIDTH, rng)
    x = regressors(n)
    few, each = (pooled((block(n),), y, x, groups) for groups in (100, 10**6))
    assert len(few.count) < 110 and len(each.count) > 0.99 * n
    powers = [np.array([1.0, 1e-5, 4e-4, 1e-3]) * s for s in (1.0, 0.9, 1.1)]
    values = [[loglik(p, power, np.zeros(3), restricted=True)[0] for power in powers] for p in (few, each)]
    assert_allclose(np.diff(values[0]), np.diff(values[1]), rtol=0, atol=0.05)
    fits = [fit_noise(p, np.zeros(3)) for p in (few, each)]
    assert_allclose(fits[0].power[[0, 2]], fits[1].power[[0, 2]], rtol=0.03)


@pytest.mark.parametrize("restricted", [True, False])
def test_the_gradient_of_the_likelihood_is_its_difference(restricted: bool) -> None:
    n, rng = 500, np.random.default_rng(2)
    y = simulated_noise({"angle_random_walk": 1.0, "bias_instability": 0.3, "rate_random_walk": 0.1}, n, WIDTH, rng)
    p = pooled((block(200), Block(0, True, 200, n, n)), y, regressors(n))
    prior = np.array([0.1, 2.0, 0.5])
    for power in ([1.0, 0.1, 0.01, 0.5], [0.2, 1e-3, 1.0, 1e-2]):
        x = np.log(power)
        value = loglik(p, np.exp(x), prior, restricted)[0]
        error = check_grad(
            lambda x: loglik(p, np.exp(x), prior, restricted)[0],
            lambda x: loglik(p, np.exp(x), prior, restricted)[1] * np.exp(x),
            x,
            epsilon=1e-6,
        )
        assert error < 1e-6 * abs(value) + 1e-3


def test_the_fit_is_at_a_maximum() -> None:
    """No step of 5 % in any power that counts gains more than the optimiser's tolerance."""
    n, rng = 2000, np.random.default_rng(3)
    for noise in (
        {"angle_random_walk": 1.0, "rate_random_walk": 0.02},
        {"bias_instability": 1.0, "quantization": 3.0},
    ):
        p = pooled((block(n),), simulated_noise(noise, n, WIDTH, rng), regressors(n))
        fit = fit_noise(p, np.zeros(3))
        for j in range(4):
            for factor in (0.95, 1.05):
                power = fit.power.copy()
                power[j] *= factor
                assert loglik(p, power, np.zeros(3), restricted=True)[0] < fit.loglik + 0.01


@dataclass(frozen=True)
class Recovery:
    noise: dict[str, float]
    told: tuple[str, ...]


#: Of each sum of noises, the coefficients that it determines to a third or better.
SUMS = {
    "white": Recovery({"angle_random_walk": 2e-6}, ("angle_random_walk",)),
    "walk": Recovery({"angle_random_walk": 1.0, "rate_random_walk": 0.05}, ("angle_random_walk", "rate_random_walk")),
    "flicker": Recovery({"angle_random_walk": 1.0, "bias_instability": 0.5}, ("angle_random_walk", "bias_instability")),
    "quantization": Recovery({"angle_random_walk": 1.0, "quantization": 3.0}, ("angle_random_walk", "quantization")),
}


@pytest.mark.parametrize("name", SUMS)
def test_coefficients_of_simulated_noise_are_found_within_their_standard_deviation(name: str) -> None:
    """Deviates of log(coefficient) over 40 seeds: mean square and mean.

    Fitted is the sum that was simulated; false alarm 2e-5 for normal deviates, seven coefficients in all.
    """
    case, n, seeds = SUMS[name], 2000, 40
    index = [[t.id for t in TERMS].index(key) for key in case.told]
    most = np.array([np.inf if t.id in case.told else 0.0 for t in TERMS])
    deviates = []
    for seed in range(seeds):
        rng = np.random.default_rng(1000 + seed)
        y = simulated_noise(case.noise, n, WIDTH, rng)
        fit = fit_noise(pooled((block(n),), y, np.ones((n, 1))), np.zeros(1), most=most)
        error = 0.5 * np.log(fit.power[index]) - np.log([case.noise[key] for key in case.told])
        assert np.all(fit.relative_sd[index] < 0.34)
        deviates.append(error / fit.relative_sd[index])
    z = np.array(deviates)
    low, high = chi2.ppf([1e-6, 1 - 1e-6], seeds)
    total = np.sum(z**2, axis=0)
    assert np.all((low < total) & (total < high)), total / seeds
    assert np.all(np.abs(z.mean(axis=0)) < 4.9 / np.sqrt(seeds)), z.mean(axis=0)


def test_all_four_terms_together_take_what_belongs_to_them() -> None:
    """The density is right at low and high frequencies though the terms cannot all be told apart."""
    n, rng = 4000, np.random.default_rng(8)
    noise = {"angle_random_walk": 1.0, "bias_instability": 0.1, "rate_random_walk": 0.02, "quantization": 1.0}
    b = (block(n),)
    mode = modes(b, TERMS, WIDTH)
    truth = mode.shapes @ np.array([noise[t.id] for t in TERMS]) ** 2
    for _ in range(5):
        y = simulated_noise(noise, n, WIDTH, rng)
        fit = fit_noise(pooled(b, y, np.ones((n, 1))), np.zeros(1))
        ratio = (mode.shapes @ fit.power)[1:] / truth[1:]
        # The 30 lowest modes tell the level there to 26 %, thousands the level above to a few per cent:
        # four standard deviations, false alarm 1e-3 over five runs.
        assert np.all(np.abs(np.log(ratio[:30])) < 4 * np.sqrt(2 / 30))
        assert np.all(np.abs(np.log(ratio[1000:])) < 0.12)


def test_the_transform_is_orthonormal_block_by_block() -> None:
    blocks = (block(70), block(51, 70))
    y = np.random.default_rng(4).standard_normal((121, 2))
    changed = transform(blocks, y)
    assert_allclose(changed.T @ changed, y.T @ y, rtol=1e-13)
    alone = [transform((block(b.n),), y[b.start : b.stop]) for b in blocks]
    assert_allclose(changed, np.concatenate(alone), rtol=0, atol=1e-14)
    lam = eigenvalues(blocks)
    assert np.flatnonzero(lam == 0).tolist() == [0, 70]
    assert changed[0] == pytest.approx(y[:70].sum(axis=0) / np.sqrt(70))


def test_powers_are_held_below_what_is_asked() -> None:
    n, rng = 1000, np.random.default_rng(5)
    p = pooled((block(n),), simulated_noise({"angle_random_walk": 1.0}, n, WIDTH, rng), np.ones((n, 1)))
    free, held = fit_noise(p, np.zeros(1)), fit_noise(p, np.zeros(1), most=np.array([0.5, 0.0, 0.0, 0.0]))
    assert held.power[0] == pytest.approx(0.5)
    assert np.all(held.power[1:] < 1e-5)
    assert held.loglik < free.loglik - 50
    assert free.power[0] == pytest.approx(1.0, rel=5 * np.sqrt(2 / n))


def test_noise_scales_with_the_data() -> None:
    """In rad/s or in deg/h: the same noise, in other units."""
    n, rng = 1000, np.random.default_rng(6)
    y = simulated_noise({"angle_random_walk": 1.0, "rate_random_walk": 0.05}, n, WIDTH, rng)
    small, large = (fit_noise(pooled((block(n),), s * y, np.ones((n, 1))), np.zeros(1)) for s in (1e-6, 1e3))
    assert_allclose(small.power[[0, 2]] * 1e18, large.power[[0, 2]], rtol=0.01)


@pytest.mark.parametrize("n", [300, 2500])
@pytest.mark.parametrize("count", [3, 9, 12])
def test_a_walk_is_found_where_regressors_leave_little_of_it(n: int, count: int) -> None:
    """The slowest waves take nearly all of a random walk: a bound on its power hid 100 of the log-likelihood."""
    y = np.random.default_rng(count * n).standard_normal(n).cumsum()
    x = np.cos(np.pi * np.outer(np.arange(n) + 0.5, np.arange(count)) / n)
    data, prior = pooled((block(n),), y, x), np.full(count, 1e-6)
    found = fit_noise(data, prior, restricted=False)
    true = np.array([0.0, 0.0, 1 / WIDTH, 0.0]) + 1e-9
    assert found.loglik > loglik(data, true, prior, restricted=False)[0] - 0.1
