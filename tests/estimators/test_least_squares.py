"""Recursive least squares: equal to the batch solution, whatever the chunks; and what goes wrong in seconds."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.common.least_squares import ALPHA, Polynomial
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import DEG_PER_HOUR

DT, SPAN, N = 0.01, 300.0, 30_000
#: From the coefficient of t^2 [m/s^2 per s] to a gyro's rate [rad/s], in deg/h.
PER_RATE = 2 / 9.8 / DEG_PER_HOUR


def velocities(n: int = N, seed: int = 0) -> Floats:
    """Two channels as a misaligned system at rest has them, with noise of 0.1 mm/s."""
    t = np.arange(1, n + 1) * DT
    clean = np.stack([-8e-3 * t + 2.6e-6 * t**2 + 4e-11 * t**3, 1.4e-2 * t - 2e-6 * t**2 - 6e-11 * t**3], axis=-1)
    return np.asarray(clean + 1e-4 * np.random.default_rng(seed).standard_normal((n, 2)))


def batch(fit: Polynomial, z: Floats) -> Floats:
    return np.asarray(np.linalg.lstsq(fit.columns(len(z)), z, rcond=None)[0])


@pytest.mark.parametrize("powers", [(1, 3), (0, 3), (1, 2), (0, 1)])
def test_equal_to_the_batch_solution(powers: tuple[int, int]) -> None:
    fit, z = Polynomial(DT, SPAN, *powers), velocities()
    found, wanted = fit.update(fit.begin(2), z).X, batch(fit, z)
    assert np.abs(found - wanted).max() < 1e-10 * np.abs(wanted).max()


@pytest.mark.parametrize("channels", [1, 2, 3])
def test_chunks_rows_and_channels_make_no_difference(channels: int) -> None:
    fit = Polynomial(DT, 4.0)
    z = np.stack([np.tile(velocities(400, seed), 2)[:, :channels] for seed in range(3)])
    whole, pieces = fit.update(fit.begin(channels, 3), z), fit.begin(channels, 3)
    for a, b in ((0, 1), (1, 1), (1, 130), (130, 400)):
        pieces = fit.update(pieces, z[:, a:b])
    np.testing.assert_array_equal(pieces.X, whole.X)
    np.testing.assert_array_equal(pieces.P, whole.P)
    for i in range(3):
        single = fit.update(fit.begin(channels), z[i])
        np.testing.assert_array_equal(single.X, whole.X[i])
        np.testing.assert_allclose(single.X, batch(fit, z[i]), rtol=1e-6, atol=1e-9)


def test_the_state_that_goes_in_is_left_alone() -> None:
    fit = Polynomial(DT, SPAN)
    before = fit.begin(2)
    fit.update(before, velocities(100))
    np.testing.assert_array_equal(before.P, ALPHA * np.eye(3))
    np.testing.assert_array_equal(before.X, 0.0)


def test_what_is_left_is_the_inverse_of_the_normal_matrix() -> None:
    fit, n = Polynomial(DT, SPAN), 20_000
    P = fit.update(fit.begin(2), velocities(n)).P
    H = fit.columns(n)
    np.testing.assert_allclose(P @ (H.T @ H), np.eye(3), atol=1e-6)


def test_scaled_time_has_the_condition_numbers_of_the_note() -> None:
    in_seconds, scaled = Polynomial(DT, 1.0).columns(N), Polynomial(DT, SPAN).columns(N)
    assert np.linalg.cond(in_seconds.T @ in_seconds) == pytest.approx(3.5e11, rel=0.05)
    assert np.linalg.cond(scaled.T @ scaled) == pytest.approx(3.1e3, rel=0.05)


def recursion_in_seconds(z: Floats, downdate: str, alpha: float) -> tuple[Floats, Floats]:
    """The plain loop with a form of the update, in unscaled time at 10 Hz; X and P."""
    P, X = alpha * np.eye(3), np.zeros((3, z.shape[1]))
    for k, value in enumerate(z):
        t = (k + 1) * 10 * DT
        h = np.array([t, t * t, t * t * t])
        gain = P @ h / (1 + h @ P @ h)
        X = X + np.outer(gain, value - h @ X)
        if downdate == "bad":
            P = P - np.outer(gain, P @ h)
        elif downdate == "good":
            P = (np.eye(3) - np.outer(gain, h)) @ P
        else:
            A = np.eye(3) - np.outer(gain, h)
            P = A @ P @ A.T + np.outer(gain, gain)
    return X, P


def test_the_symmetric_downdate_in_seconds_goes_indefinite() -> None:
    z = velocities()[9::10]
    wanted = batch(Polynomial(10 * DT, 1.0), z)
    X, P = recursion_in_seconds(z, "bad", 1e12)
    assert np.linalg.eigvalsh(0.5 * (P + P.T)).min() < 0
    # How far off it is, is rounding of the machine's own kernels: 2.5e-4 to above 1e-3.
    assert np.abs(X - wanted)[1].max() * PER_RATE > 1e-5
    for form in ("good", "joseph"):
        X, P = recursion_in_seconds(z, form, 1e12)
        assert np.abs(X - wanted)[1].max() * PER_RATE < 1e-8


def test_in_scaled_time_the_kernel_is_good_for_any_large_alpha() -> None:
    fit, z = Polynomial(DT, SPAN), velocities()
    wanted = batch(Polynomial(DT, 1.0), z)
    for alpha in (1e8, 1e12, 1e16):
        found = fit.coefficients(fit.update(fit.begin(2, alpha=alpha), z))
        assert np.abs(found - wanted)[1].max() * PER_RATE < 1e-6


def test_a_small_alpha_pulls_the_result() -> None:
    fit, z = Polynomial(DT, SPAN), velocities()
    wanted = batch(Polynomial(DT, 1.0), z)
    pulls = []
    for alpha in (1e2, 1e4):
        found = fit.coefficients(fit.update(fit.begin(2, alpha=alpha), z))
        pulls.append(np.abs(found - wanted)[1].max() * PER_RATE)
    assert pulls[0] > 1e-4 > pulls[1] > 1e-6
    assert pulls[0] / pulls[1] == pytest.approx(100, rel=0.1)


def test_bad_input_is_refused() -> None:
    fit = Polynomial(DT, SPAN)
    with pytest.raises(InputError, match="wanted"):
        fit.update(fit.begin(2), np.zeros((5, 3)))
    with pytest.raises(InputError, match="wanted"):
        fit.update(fit.begin(2, 4), np.zeros((3, 5, 2)))
    for wrong in (Polynomial(0.0, SPAN), Polynomial(DT, SPAN, 2, 1)):
        with pytest.raises(InputError, match="wanted"):
            wrong.begin()
