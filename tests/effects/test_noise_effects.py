"""Simulated noise against its own formulas: spectrum, Allan deviation, density, and the start of a run."""

from dataclasses import replace

import numpy as np
import pytest
from motions import rich_motion
from scipy.fft import dct
from scipy.signal import butter, sosfilt
from scipy.stats import chi2

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.series.allan import allan_deviation
from insenv.core.series.cascade import cascade
from insenv.effects.base import OUTPUT, NoiseEffect
from insenv.effects.noise import (
    AngleRandomWalk,
    BiasInstability,
    Quantization,
    RateRandomWalk,
    readings_density,
)

DT = 0.01
NOISES = (AngleRandomWalk(), BiasInstability(), RateRandomWalk(), Quantization(period=DT))
every_noise = pytest.mark.parametrize("effect", NOISES, ids=lambda effect: effect.id)
#: What the flicker filter may be off in density, besides chance.
FLICKER_RIPPLE = 0.01


def simulated(effect: NoiseEffect, rows: int, n: int, seed: int, size: float = 1.0) -> Floats:
    """Runs in their stationary state, shape (rows, n)."""
    rng = np.random.default_rng(seed)
    theta = np.array([size])
    state = effect.start(rng.standard_normal((rows, effect.draws_at_start)))
    return effect.drive(theta, DT, state, rng.standard_normal((rows, effect.draws, n)))[0]


@every_noise
def test_dct_variances_match_the_spectrum(effect: NoiseEffect) -> None:
    """Chi-square in bands of modes; false alarms: 4 noises, 12 bands, 1e-7 each: 5e-6 in all."""
    rows, n = 48, 4096
    y = simulated(effect, rows, n, seed=5, size=3e-4)
    k = np.arange(n)
    lam = 4 * np.sin(np.pi * k[1:] / (2 * n)) ** 2
    expected = 9e-8 * effect.spectrum(lam, DT)
    if effect.id == "quantization":  # the errors at both ends of the run belong to no neighbour
        expected += 9e-8 * 4 / n * np.cos(np.pi * k[1:] / (2 * n)) ** 2 / DT**2
    ratio = dct(y, type=2, norm="ortho", axis=-1)[:, 1:] ** 2 / expected
    # The lowest modes of 1/f noise feel the ends of the run.
    first = 20 if effect.id == "bias_instability" else 1
    ripple = FLICKER_RIPPLE if effect.id == "bias_instability" else 0.0
    bands = np.unique(np.geomspace(first, n - 1, 13).astype(int))
    for a, b in zip(bands[:-1], bands[1:], strict=True):
        total, m = ratio[:, a - 1 : b - 1].sum(), rows * (b - a)
        # 1/f noise is correlated between these modes, by less than 1 %: the sum's variance is 0.2 % larger.
        assert chi2.cdf(total / (1 + ripple), m) < 1 - 5e-8, (a, b, total / m)
        assert chi2.cdf(total / (1 - ripple), m) > 5e-8, (a, b, total / m)


@pytest.mark.parametrize(
    ("mode", "share"),
    [(1, 0.774), (2, 0.903), (3, 0.931), (8, 0.975), (64, 0.997)],
)
def test_low_modes_of_flicker_have_the_share_that_is_stated(mode: int, share: float) -> None:
    """Exact variance of one mode of averaged 1/f noise, from its generalised covariance -ln|tau| / pi."""
    n = 256

    def twice_integrated(x: Floats) -> Floats:
        x = np.abs(x)
        return np.where(x > 0, x**2 * (0.5 * np.log(np.where(x > 0, x, 1.0)) - 0.75), 0.0)

    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n))).astype(float)
    covariance = -(twice_integrated(lag + 1) - 2 * twice_integrated(lag) + twice_integrated(lag - 1)) / np.pi
    shape = np.sqrt(2 / n) * np.cos(np.pi * mode * (np.arange(n) + 0.5) / n)
    lam = np.array([4 * np.sin(np.pi * mode / (2 * n)) ** 2])
    formula = BiasInstability().spectrum(lam, 1.0)[0]
    assert shape @ covariance @ shape / formula == pytest.approx(share, abs=1e-3)


def test_the_random_walk_is_diagonal_in_the_dct() -> None:
    """Exact covariance of the driven means, from their response to each unit normal alone."""
    n = 64
    effect = RateRandomWalk()
    response = effect.drive(np.array([1.0]), DT, None, np.eye(n)[:, None, :])[0]
    modes = dct(np.eye(n), type=2, norm="ortho", axis=0)
    covariance = modes @ response.T @ response @ modes.T
    lam = 4 * np.sin(np.pi * np.arange(1, n) / (2 * n)) ** 2
    # The first step alone is not that of a mean from zero, which moves the whole run: mode 0.
    np.testing.assert_allclose(covariance[1:, 1:], np.diag(effect.spectrum(lam, DT)), atol=1e-9)


@every_noise
def test_allan_deviation_matches_its_formula(effect: NoiseEffect) -> None:
    """Mean over runs within six standard errors: Student's t, 31 dof, 20 figures: 2e-5 false alarms."""
    rows = 32
    taus = DT * np.array([1, 4, 16, 64, 256])
    y = simulated(effect, rows, 8192, seed=11, size=2e-3)
    variances = np.array([allan_deviation(row, DT, taus).deviation ** 2 for row in y])
    expected = effect.allan(np.array([2e-3]), taus) ** 2
    error = np.abs(variances.mean(axis=0) - expected)
    allowed = 6 * variances.std(axis=0, ddof=1) / np.sqrt(rows)
    if effect.id == "bias_instability":
        allowed += FLICKER_RIPPLE * expected
    assert np.all(error < allowed), variances.mean(axis=0) / expected
    assert np.all(allowed < 0.4 * expected)  # the test can fail


@every_noise
def test_readings_have_the_density_of_the_rate_at_low_frequencies(effect: NoiseEffect) -> None:
    theta, f = np.array([2e-3]), np.array([1e-3, 1e-2, 0.1])
    found = readings_density(effect, theta, f, DT)
    np.testing.assert_allclose(found, effect.psd(theta, f), rtol=1e-5)
    batch = np.array([[1e-3], [2e-3]])
    np.testing.assert_array_equal(effect.psd(batch, f)[1], effect.psd(theta, f))
    np.testing.assert_array_equal(effect.allan(batch, f)[1], effect.allan(theta, f))


def test_the_density_of_quantization_depends_on_the_period_of_the_readings() -> None:
    theta, f = np.array([1.0]), np.array([0.5])
    once, twice = Quantization(period=0.1), Quantization(period=0.2)
    np.testing.assert_allclose(twice.psd(theta, f), 2 * once.psd(theta, f))


@pytest.mark.parametrize("decades", [3.0, 5.0, 7.0])
def test_the_flicker_filter_has_the_spectrum_within_one_percent(decades: float) -> None:
    """Fourier transform of the response to one unit normal, no chance in it, over five decades at most."""
    n = 1 << 20
    impulse = np.zeros((1, n))
    impulse[0, 0] = 1.0
    response, _ = BiasInstability(decades=decades).drive(np.array([1.0]), DT, None, impulse)
    f = np.geomspace(10.0 ** -min(decades, 5.0), 0.5, 200)
    k = np.unique(np.round(f * n).astype(int))
    # Beyond its end the response goes on as about 1 / sqrt(k): it is faded out to keep its edge from leaking.
    fade = np.cos(0.5 * np.pi * np.arange(n) / n) ** 2
    density = np.abs(np.fft.rfft(response * fade)[k]) ** 2
    expected = BiasInstability().spectrum(4 * np.sin(np.pi * k / n) ** 2, 1.0)
    assert np.abs(density / expected - 1).max() < FLICKER_RIPPLE


def test_flicker_is_stationary_from_its_first_sample() -> None:
    """Variance and variogram at the start and later on, over runs.

    Five standard errors of a chi-square with 6000 degrees of freedom, 5 figures: 3e-6 false alarms.
    """
    rows = 6000
    y = simulated(BiasInstability(), rows, 400, seed=3)
    tolerance = 5 * np.sqrt(2 / rows)
    variance = np.mean(y**2, axis=0)
    # The variance is that of 1/f from its lower corner to the sampling rate, and no more than two decades of
    # leeway below the corner: ln 10 / pi for each decade.
    per_decade = np.log(10) / np.pi
    assert 7 * per_decade < variance[0] < 9 * per_decade
    assert variance[-1] / variance[0] == pytest.approx(1.0, abs=2 * tolerance)
    for m in (1, 10, 200):
        early = y[:, m : 2 * m].mean(axis=-1) - y[:, :m].mean(axis=-1)
        found = 0.5 * np.mean(early**2) / (2 * np.log(2) / np.pi)
        assert found == pytest.approx(1.0, abs=tolerance + FLICKER_RIPPLE), m


def test_without_a_start_flicker_is_switched_on_at_zero() -> None:
    z = np.random.default_rng(1).standard_normal((2000, 1, 1))
    first, _ = BiasInstability().drive(np.array([1.0]), DT, None, z)
    assert np.var(first) < 1.0 < np.var(simulated(BiasInstability(), 2000, 1, seed=1))


@pytest.mark.parametrize("decades", [0.5, 7.5, float("nan")])
def test_decades_out_of_range_are_refused(decades: float) -> None:
    with pytest.raises(InputError, match="wanted 1 to 7"):
        BiasInstability(decades=decades)


def test_quantization_in_sums_stays_within_the_angle_error() -> None:
    y = simulated(Quantization(), 1, 5000, seed=2, size=1e-5)
    angle = np.cumsum(y) * DT
    # Difference of two errors of 1e-5 each; a normal beyond seven standard deviations: 2e-8 false alarms.
    assert np.abs(angle).max() < 7 * np.sqrt(2) * 1e-5


@every_noise
def test_chunks_are_the_whole_bit_for_bit(effect: NoiseEffect) -> None:
    rng = np.random.default_rng(8)
    z = rng.standard_normal((2, 3, effect.draws, 1000))
    theta = np.array([[0.1], [0.2], [0.3]])
    start = effect.start(rng.standard_normal((2, 3, effect.draws_at_start)))
    kept = z.copy()
    whole, end = effect.drive(theta, DT, start, z)
    state, parts = start, []
    for a, b in ((0, 1), (1, 500), (500, 1000)):
        part, state = effect.drive(theta, DT, state, z[..., a:b])
        parts.append(part)
    np.testing.assert_array_equal(np.concatenate(parts, axis=-1), whole)
    if end is not None:
        np.testing.assert_array_equal(state, end)
    np.testing.assert_array_equal(z, kept)


@every_noise
def test_a_row_of_starts_is_the_single_start(effect: NoiseEffect) -> None:
    z = np.random.default_rng(4).standard_normal((5, effect.draws_at_start))
    batch = effect.start(z)
    for i in range(5):
        single = effect.start(z[i])
        if single is not None:
            np.testing.assert_array_equal(batch[i], single)


def test_a_noise_effect_without_normals_says_so() -> None:
    motion = rich_motion(5)
    for effect in NOISES:
        with pytest.raises(ValueError, match="needs unit normals"):
            effect.apply(motion.rate, motion, np.array([1.0]))


def test_units_follow_the_measured_quantity() -> None:
    units = [effect.linear[0].unit for effect in NOISES]
    assert [unit.replace(OUTPUT, "rad/s") for unit in units] == [
        "rad/s sqrt(s)",
        "rad/s",
        "rad/s/sqrt(s)",
        "rad/s s",
    ]
    assert replace(Quantization(), period=2.0).period == 2.0


@pytest.mark.parametrize("batch", [(), (3,), (2, 3)])
def test_the_cascade_is_that_of_scipy_bit_for_bit(batch: tuple[int, ...]) -> None:
    """Whole, in chunks, and from rest; what goes in is left as it is."""
    rng = np.random.default_rng(11)
    sections = butter(7, [0.01, 0.3], "bandpass", output="sos")
    x, state = rng.standard_normal((*batch, 300)), rng.standard_normal((*batch, len(sections), 2))
    given = x.copy(), state.copy()
    whole, after = sosfilt(sections, x, zi=np.moveaxis(state, -2, 0))
    y, end = cascade(sections, x, state)
    np.testing.assert_array_equal(y, whole)
    np.testing.assert_array_equal(np.moveaxis(end, -2, 0), after)
    parts, now = [], state
    for chunk in np.split(x, [0, 1, 140], axis=-1):
        part, now = cascade(sections, chunk, now)
        parts.append(part)
    np.testing.assert_array_equal(np.concatenate(parts, axis=-1), whole)
    np.testing.assert_array_equal(now, end)
    np.testing.assert_array_equal(cascade(sections, x)[0], sosfilt(sections, x))
    np.testing.assert_array_equal(x, given[0])
    np.testing.assert_array_equal(state, given[1])
