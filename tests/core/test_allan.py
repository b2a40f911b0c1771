"""Overlapping Allan deviation: published values, allantools as the oracle, and intervals that cover."""

from typing import Any

import allantools
import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.core.series import allan
from insenv.core.series.allan import POWER_LAWS, allan_deviation, log_taus, octave_taus


def test_nbs14_ten_points() -> None:
    """NIST SP 1065, test data NBS14 (NBS Monograph 140, annex 8.E)."""
    rates = [892, 809, 823, 798, 671, 644, 883, 903, 677]
    found = allan_deviation(rates, 1.0, [1.0, 2.0])
    np.testing.assert_allclose(found.deviation, [91.22945, 85.95287], rtol=1e-7)


def _nbs14_thousand_points() -> np.ndarray:
    """NIST SP 1065, section 12.4: n' = 16807 n mod 2147483647 from 1234567890, divided by the modulus."""
    n = [1234567890]
    while len(n) < 1000:
        n.append(16807 * n[-1] % 2147483647)
    return np.array(n) / 2147483647


def test_nbs14_thousand_points() -> None:
    rates = _nbs14_thousand_points()
    assert rates.mean() == pytest.approx(4.897745e-1, abs=5e-8)  # published with the set
    found = allan_deviation(rates, 1.0, [1.0, 10.0, 100.0])
    np.testing.assert_allclose(found.deviation, [2.922319e-1, 9.159953e-2, 3.241343e-2], rtol=2e-7)
    assert found.alpha[0] == 0


def _series(kind: str, n: int, seed: int) -> np.ndarray:
    """Rates of one power law, unit scale; flicker by shaping white noise in the spectrum."""
    white = np.random.default_rng(seed).standard_normal(2 * n)
    if kind == "quantization":
        return np.diff(white)[:n]
    if kind == "angle_random_walk":
        return white[:n]
    if kind == "rate_random_walk":
        return np.cumsum(white)[:n]
    frequency = np.fft.rfftfreq(2 * n)
    frequency[0] = np.inf
    return np.fft.irfft(np.fft.rfft(white) / np.sqrt(frequency))[:n]


@pytest.mark.parametrize("kind", POWER_LAWS)
@pytest.mark.parametrize(("offset", "slope"), [(0.0, 0.0), (1e4, 0.0), (-3.0, 1e-2)])
def test_equal_to_allantools(kind: str, offset: float, slope: float) -> None:
    n, dt = 30_000, 0.01
    rates = offset + slope * np.arange(n) + _series(kind, n, seed=1)
    taus = np.arange(1, n // 2, 457) * dt
    found = allan_deviation(rates, dt, taus)
    taus_oracle, oracle, _, _ = allantools.oadev(rates, rate=1 / dt, data_type="freq", taus=taus)
    np.testing.assert_allclose(found.taus, taus_oracle, rtol=1e-12)
    np.testing.assert_allclose(found.deviation, oracle, rtol=1e-12)


@settings(max_examples=50, deadline=None)
@given(st.integers(2, 300), st.integers(0, 2**32 - 1), st.floats(1e-4, 1e3))
def test_every_averaging_factor_against_numpy(n: int, seed: int, dt: float) -> None:
    rates = np.random.default_rng(seed).standard_normal(n)
    factors = np.arange(1, n // 2 + 1)
    x = np.concatenate([[0.0], np.cumsum(rates)])
    direct = [np.sqrt(np.mean((x[2 * m :] - 2 * x[m : len(x) - m] + x[: -2 * m]) ** 2) / 2) / m for m in factors]
    found = allan_deviation(rates, dt, factors * dt)
    np.testing.assert_allclose(found.deviation, direct, rtol=1e-9, atol=1e-13)
    assert (found.lower < found.deviation).all() and (found.deviation < found.upper).all()
    assert (found.edf >= 0.99).all()


def test_blocks_join_without_a_seam() -> None:
    x = np.random.default_rng(2).standard_normal(3 * 8192 + 5)
    factors = np.array([1, 2, 4095, 4096, 4097, 8192, 12000])
    direct = [np.sum((x[2 * m :] - 2 * x[m : x.size - m] + x[: -2 * m]) ** 2) for m in factors]
    compiled = allan._compiled(allan._squared_second_differences)(x, factors)
    np.testing.assert_allclose(compiled, direct, rtol=1e-12)


def test_short_and_long_series_are_summed_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    rate = np.random.default_rng(4).standard_normal(3000) + 7.0
    found = []
    for least in (0, 10**9):
        monkeypatch.setattr(allan, "LONG", least)
        found.append(allan.allan_deviation(rate, 0.1))
    for name in ("deviation", "lower", "upper", "edf", "alpha"):
        np.testing.assert_allclose(getattr(found[0], name), getattr(found[1], name), rtol=1e-12)


def test_row_of_a_batch_is_the_single_run() -> None:
    rates = np.random.default_rng(3).standard_normal((2, 3, 500))
    together, single = allan_deviation(rates, 0.1), allan_deviation(rates[1, 2], 0.1)
    assert together.deviation.shape == (2, 3, len(together.taus))
    for name in ("deviation", "lower", "upper", "edf", "alpha"):
        np.testing.assert_array_equal(getattr(together, name)[1, 2], getattr(single, name))


def test_a_constant_and_a_ramp() -> None:
    np.testing.assert_allclose(allan_deviation(np.full(100, 0.1), 1.0).deviation, 0.0, atol=1e-15)
    ramp = allan_deviation(0.3 * np.arange(100), 1.0)  # slope R: R tau / sqrt(2), IEEE Std 952-1997, annex C
    np.testing.assert_allclose(ramp.deviation, 0.3 * ramp.taus / np.sqrt(2), rtol=1e-12)


def test_averaging_times() -> None:
    np.testing.assert_allclose(octave_taus(100, 0.5), [0.5, 1, 2, 4, 8])
    np.testing.assert_allclose(octave_taus(3, 0.5), [0.5])
    taus = log_taus(1_000_000, 0.01)
    assert len(taus) <= 50 and taus[0] == 0.01 and taus[-1] == pytest.approx(2500.0)
    assert (np.diff(taus) > 0).all()
    repeated = allan_deviation(np.arange(20.0) ** 2, 0.1, [0.42, 0.1, 0.4, 0.1])
    np.testing.assert_allclose(repeated.taus, [0.1, 0.4])


@pytest.mark.parametrize(
    ("rates", "dt", "taus", "message"),
    [
        (1.0, 1.0, None, "of 0 rates"),
        ([], 1.0, None, "of 0 rates"),
        ([1.0], 1.0, None, "of 1 rates"),
        ([1.0, np.nan, 2.0], 1.0, None, "with NaN or infinity"),
        ([1.0, np.inf, -np.inf], 1.0, None, "with NaN or infinity"),
        (np.arange(10.0), 0.1, [0.6], "averaging time of 0.6 s .* wanted from 0.1 s to 0.5 s"),
        (np.arange(10.0), 0.1, [0.01], "averaging time of 0.01 s"),
        (np.arange(10.0), 0.1, [np.nan], "averaging time of nan s"),
        (np.arange(10.0), -0.1, [-0.1], "rates -0.1 s apart"),
        (np.arange(10.0), 0.0, None, "rates 0 s apart"),
        (np.arange(10.0), np.nan, None, "rates nan s apart"),
    ],
)
def test_bad_input(rates: object, dt: float, taus: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        allan_deviation(rates, dt, taus)  # type: ignore[arg-type]


# Beside Greenhall and Riley's interpolated tables (good to a few per cent); their phase is averaged over a
# sample, so short averages of white rate noise, exact here, are compared with the fitted formula of SP 1065,
# table 5.
@pytest.mark.parametrize("alpha", [2, -1, -2])
@pytest.mark.parametrize(("n", "m"), [(100, 20), (1000, 4), (1000, 10), (1000, 100), (100_000, 1000)])
def test_degrees_of_freedom(alpha: int, n: int, m: int) -> None:
    oracle = allantools.edf_greenhall(alpha, 2, m, n + 1, overlapping=True)
    assert allan._edf(alpha, m, n + 1 - 2 * m) == pytest.approx(oracle, rel=0.05)


@pytest.mark.parametrize(("n", "m"), [(1000, 1), (1000, 4), (1000, 10), (1000, 100), (100_000, 1000)])
def test_degrees_of_freedom_of_white_rate_noise(n: int, m: int) -> None:
    assert allan._edf(0, m, n + 1 - 2 * m) == pytest.approx(allantools.edf_simple(n + 1, m, 0), rel=0.05)


def test_degrees_of_freedom_of_many_terms_are_those_of_the_full_sum() -> None:
    m, terms = 700, 5000
    for alpha in (0, -1, -2):
        lags = np.arange(1, terms)
        rho = allan._correlation(alpha, lags / m)
        full = terms / (1 + 2 * np.sum((1 - lags / terms) * rho**2))
        assert allan._edf(alpha, m, terms) == pytest.approx(full, rel=0.02)


# 50 series of 2000 rates, seeded. An autocorrelation of 2000/m averages has a standard deviation of at most
# 1/sqrt(2000/m), 0.045, and a wrong decision wants 0.1: 3 % for one series, and 5 wrong of 50 are allowed (2
# %).
@pytest.mark.parametrize(("kind", "alpha"), POWER_LAWS.items())
@pytest.mark.parametrize("m", [1, 4])
def test_power_law_is_identified(kind: str, alpha: int, m: int) -> None:
    rates = np.stack([_series(kind, 2000, seed) + 1e-5 * np.arange(2000) for seed in range(50)])
    found = allan_deviation(rates, 1.0, [float(m)]).alpha
    assert np.mean(found == alpha) >= 0.9


# 400 independent series, coverage 0.68 with standard deviation 0.023; chi-square with edf is an
# approximation, hence 0.10 of room: false alarm below 1e-4 for each case.
@pytest.mark.parametrize("kind", POWER_LAWS)
@pytest.mark.parametrize("m", [4, 50])
def test_interval_covers(kind: str, m: int) -> None:
    n = 400
    deviations = allan_deviation(np.stack([_series(kind, n, s) for s in range(400)]), 1.0, [float(m)], noise=kind)
    truth = np.sqrt(np.mean(deviations.deviation**2))
    covered = np.mean((deviations.lower < truth) & (truth < deviations.upper))
    assert covered == pytest.approx(0.6827, abs=0.10)


def test_a_folder_without_a_cache_still_computes(monkeypatch: pytest.MonkeyPatch) -> None:
    njit = numba.njit

    def without_cache(*args: Any, **options: Any) -> Any:
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return njit(*args, **options)

    monkeypatch.setattr(numba, "njit", without_cache)
    allan._compiled.cache_clear()
    x = np.arange(10.0) ** 2
    np.testing.assert_allclose(allan._compiled(allan._squared_second_differences)(x, np.array([1])), [8 * 4.0])
    allan._compiled.cache_clear()
