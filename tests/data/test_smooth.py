"""The smooth curve of a noisy temperature, of which instruments follow the derivative."""

from __future__ import annotations

import numpy as np

from insenv.data.smooth import smoothed


def test_the_slope_of_a_unit_that_warms_up_is_right_from_its_first_seconds() -> None:
    t = np.arange(1200.0)
    warm = 20 + 12 * (1 - np.exp(-t / 150)) + 0.5 * np.sin(2 * np.pi * t / 400)
    slope = 12 / 150 * np.exp(-t / 150) + 0.5 * 2 * np.pi / 400 * np.cos(2 * np.pi * t / 400)
    rng = np.random.default_rng(3)
    read = np.round((warm + 0.003 * rng.standard_normal(len(t))) / 0.01) * 0.01
    error = np.gradient(smoothed(read)) - slope
    # Reading noise alone would put 3e-3 K/s on each difference; ends that bend must not hinder the smoothing.
    assert np.std(error) < 3e-4
    assert np.abs(error[:5]).max() < 3e-3


def test_a_thermometer_in_coarse_steps_is_read_between_them() -> None:
    t = 5.0 * np.arange(5000)
    true = 20 + 5 * np.sin(2 * np.pi * t / 7700)
    read = np.round(true / 0.5) * 0.5
    # The stairs leave 0.14 K; a curve that follows them, as cross-validation by itself does, 0.11.
    assert np.std(smoothed(read, 0.5) - true) < 0.03


def test_a_thermometer_with_noise_beyond_its_steps_is_smoothed_as_before() -> None:
    noise = 0.1 * np.random.default_rng(4).standard_normal(3000)
    read = np.round((20 + np.linspace(0, 8, 3000) ** 0.5 + noise) / 0.01) * 0.01
    assert np.array_equal(smoothed(read, 0.01), smoothed(read))
