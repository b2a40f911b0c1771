"""Two-sided density: its level, its sum and its interval."""

import numpy as np
import pytest

from insenv.core.errors import InputError
from insenv.core.series.spectrum import psd


# 64 segments x 312 frequencies of white noise: the mean of all has a relative standard deviation below 0.02
def test_white_noise_has_the_density_of_its_angle_random_walk() -> None:
    angle_random_walk, dt = 3e-4, 0.01
    rates = angle_random_walk / np.sqrt(dt) * np.random.default_rng(1).standard_normal(20_000)
    found = psd(rates, dt, 63)
    assert found.density.mean() == pytest.approx(angle_random_walk**2, rel=0.1)
    covered = np.mean((found.lower < angle_random_walk**2) & (angle_random_walk**2 < found.upper))
    assert covered == pytest.approx(0.6827, abs=0.15)  # about 150 independent values: standard deviation 0.04


def test_a_line_keeps_its_power_and_its_place() -> None:
    dt, amplitude = 0.01, 2.0
    rates = 5.0 + amplitude * np.sin(2 * np.pi * 12.0 * dt * np.arange(10_000))
    found = psd(rates, dt, 9)
    assert found.f[np.argmax(found.density)] == pytest.approx(12.0, abs=0.05)
    assert 2 * np.sum(found.density) * (found.f[1] - found.f[0]) == pytest.approx(amplitude**2 / 2, rel=1e-3)


@pytest.mark.parametrize("n", [999, 1000, 1001])
def test_shapes_and_frequencies(n: int) -> None:
    rates = np.random.default_rng(2).standard_normal((2, n))
    found = psd(rates, 0.5, 3)
    assert found.density.shape == found.lower.shape == (2, len(found.f))
    assert found.f[0] > 0 and found.f[-1] < 1.0
    np.testing.assert_allclose(found.density[1], psd(rates[1], 0.5, 3).density, rtol=1e-12)
    assert (found.lower < found.density).all() and (found.density < found.upper).all()


@pytest.mark.parametrize("rates", [np.zeros(30), np.full(1000, np.nan), 1.0])
def test_bad_input(rates: object) -> None:
    with pytest.raises(InputError, match="wanted at least 64 rates, all of them finite"):
        psd(rates, 1.0, 15)  # type: ignore[arg-type]
