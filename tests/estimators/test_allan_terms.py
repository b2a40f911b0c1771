"""Terms of the Allan variance: what is put in comes out; what is none of them is left out, or said."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from estimators.common.allan_terms import TERMS, _correlation, fitted, floor
from insenv.core.rate_test import AllanTerm
from insenv.core.recording import Floats
from insenv.effects.catalogue import by_key

N, DT = 40_000, 0.1
TRUTH = {"angle_random_walk": 1.0, "bias_instability": 0.3, "rate_random_walk": 0.02}


def curve(values: dict[str, float], taus: Floats) -> Floats:
    """Allan variance by the formulas of the effects that simulate."""
    return np.asarray(sum(by_key(k).allan(np.array([v]), taus) ** 2 for k, v in values.items()), np.float64)  # type: ignore[attr-defined]


def octaves(n: int = N, dt: float = DT) -> tuple[Floats, Floats]:
    taus = np.asarray(dt * 2.0 ** np.arange(int(np.log2(n / 3))), np.float64)
    return taus, np.maximum(2 / 3 * (n * dt / taus - 1), 1.0)


def estimated(x: Floats, dt: float) -> tuple[Floats, Floats, Floats]:
    """Averaging times, Allan variance and degrees of freedom of samples."""
    taus, variance, edf, tau = [], [], [], dt
    while len(x) >= 3:
        steps = np.diff(x)
        taus.append(tau)
        variance.append(np.mean(steps**2) / 2)
        edf.append(max(2 * len(steps) / 3, 1.0))
        x, tau = x[: len(x) // 2 * 2].reshape(-1, 2).mean(axis=1), 2 * tau
    return np.array(taus), np.array(variance), np.array(edf)


def noise(seed: int) -> Floats:
    """White rate, flicker and random walk as `TRUTH`, samples means over `DT`."""
    rng, fine = np.random.default_rng(seed), 4
    m = 4 * fine * N
    f = np.fft.rfftfreq(m, DT / fine)
    f[0] = f[1]
    z = rng.standard_normal(len(f)) + 1j * rng.standard_normal(len(f))
    flicker = np.fft.irfft(z * TRUTH["bias_instability"] * np.sqrt(m * fine / DT / (4 * np.pi * f)), m)
    x = flicker[: fine * N].reshape(-1, fine).mean(axis=1)
    walk = np.cumsum(TRUTH["rate_random_walk"] * np.sqrt(DT) * rng.standard_normal(N))
    return np.asarray(x + walk + TRUTH["angle_random_walk"] / np.sqrt(DT) * rng.standard_normal(N), np.float64)


@pytest.mark.parametrize("name", TRUTH)
def test_a_term_alone_is_found_alone(name: str) -> None:
    taus, edf = octaves()
    found = fitted(taus, curve({name: 0.7}, taus), edf)
    assert found.fits and not found.others and not found.left_out
    assert found.coefficients[name].value == pytest.approx(0.7, rel=1e-3)
    for other in TERMS:
        assert found.coefficients[other].sd > 0
        if other != name:
            assert found.coefficients[other].value <= 2 * found.coefficients[other].sd


@pytest.mark.parametrize("walk", [False, True])
def test_the_correlation_of_the_estimates_is_that_of_many_records(walk: bool) -> None:
    """Of 600 records: a correlation is known to 0.04; four of it at the shortest times, where samples are coarse."""
    rng = np.random.default_rng(0)
    many = [np.cumsum(rows) if walk else rows for rows in rng.standard_normal((600, 4096))]
    measured = np.corrcoef(np.array([estimated(x, 1.0)[1][2:8] for x in many]).T)
    taus = np.asarray(2.0 ** np.arange(2, 8), np.float64)
    x = np.array([0, 0, 0, 1.0, 0]) if walk else np.array([0, 1.0, 0, 0, 0])
    told = _correlation(taus, taus / 3 if walk else 1 / taus, x, (), 5)
    assert_allclose(np.diag(measured, 1), np.diag(told, 1), rtol=0, atol=0.16)
    assert_allclose(np.diag(measured, 2), np.diag(told, 2), rtol=0, atol=0.16)


def test_all_terms_together_are_told_apart() -> None:
    taus, edf = octaves()
    found = fitted(taus, curve(TRUTH, taus), edf)
    for name, value in TRUTH.items():
        assert found.coefficients[name].value == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("term", [AllanTerm("markov", 2.0, 5.0), AllanTerm("sinusoid", 0.05, 1.0)])
def test_a_markov_process_and_a_sinusoid_do_not_move_the_others(term: AllanTerm) -> None:
    taus, edf = octaves()
    found = fitted(taus, curve(TRUTH, taus) + term.variance(taus), edf)
    assert found.fits
    for name, value in TRUTH.items():
        c = found.coefficients[name]
        assert abs(c.value - value) < max(0.1 * value, 3 * c.sd)


@pytest.mark.parametrize("hump", [1.5, 3.0, 0.3])
def test_a_filter_at_short_times_does_not_move_the_floor(hump: float) -> None:
    """Today's failure: degrees of freedom by the thousand at short times forced any term to follow a filter there."""
    taus, edf = octaves()
    shape = 1 + (hump - 1) * np.exp(-((np.log(taus / 0.3) / 0.8) ** 2))
    found = fitted(taus, curve(TRUTH, taus) * shape, edf)
    assert found.fits and (found.left_out or found.others)
    b = found.coefficients["bias_instability"]
    assert abs(b.value - 0.3) < max(0.25 * 0.3, 3 * b.sd)


def test_what_no_model_fits_has_no_figures() -> None:
    taus, edf = octaves()
    rough = curve(TRUTH, taus) * np.where(np.arange(len(taus)) % 2, 3.0, 1.0)
    found = fitted(taus, rough, np.full_like(edf, 1e5))
    assert not found.fits
    assert all(np.isnan(c.value) for c in found.coefficients.values())


def test_the_terms_never_exceed_what_was_measured() -> None:
    """Of random curves: no fitted term stands above the measured deviation where the model is said to hold."""
    taus, edf = octaves()
    for seed in range(20):
        rng = np.random.default_rng(seed)
        steps = np.cumsum(rng.normal(-0.3, 0.5, len(taus)))
        variance = np.exp(steps) * rng.chisquare(edf) / edf
        found = fitted(taus, variance, edf)
        b = found.coefficients["bias_instability"].value
        if found.fits:
            kept = np.flatnonzero((edf >= 20) & (np.arange(len(taus)) >= found.left_out))
            highest = np.sqrt(variance[kept] * (1 + 6 * np.sqrt(2 / edf[kept])))
            assert (0.664 * b <= highest).all()


def test_the_floor_is_read_where_there_is_one() -> None:
    taus, edf = octaves()
    level, at = floor(
        taus, curve({"bias_instability": 0.3, "angle_random_walk": 0.05, "rate_random_walk": 3e-4}, taus), edf
    )
    assert level.value == pytest.approx(0.3, rel=0.05) and taus[0] < at < taus[-1]
    falling, _ = floor(taus, curve({"angle_random_walk": 1.0}, taus), edf)
    assert np.isnan(falling.value)


def test_a_markov_term_is_white_at_long_times_and_a_walk_at_short_ones() -> None:
    term = AllanTerm("markov", 3.0, 2.0)
    assert_allclose(term.variance(np.array([3e4])), 2.0 * 9.0 / 3e4, rtol=1e-3)
    assert_allclose(term.variance(np.array([1e-5, 1e-2])), 2.0 * np.array([1e-5, 1e-2]) / 3, rtol=1e-2)


@pytest.mark.slow
def test_deviations_are_as_large_as_told() -> None:
    """60 records: the standard deviation of z is known to 9 %; false alarm below 1e-3. Squares, nearly Gaussian."""
    z = []
    for seed in range(60):
        found = fitted(*estimated(noise(seed), DT)).coefficients
        z.append(
            [
                (found[k].value ** 2 - v**2) / max(2 * found[k].value * found[k].sd, found[k].sd ** 2)
                for k, v in TRUTH.items()
            ]
        )
    spread, centre = np.std(z, axis=0), np.mean(z, axis=0)
    assert ((spread > 0.65) & (spread < 1.35)).all(), spread
    assert (np.abs(centre) < 0.75).all(), centre
