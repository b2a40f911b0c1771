"""Rounding that noise does not blur: how much of it is one in all rows of a rate."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from insenv.core.series.coarse import coarse, undithered


def rounded(s: float) -> tuple[float, float]:
    """Mean square of the error and scatter of a row, by sums over all readings at all inputs; in steps, squared."""
    x, n = np.linspace(-0.5, 0.5, 400, endpoint=False), np.arange(-8, 9)
    chance = norm.cdf((n + 0.5 - x[:, None]) / s) - norm.cdf((n - 0.5 - x[:, None]) / s)
    mean = chance @ n
    return float(np.mean((mean - x) ** 2)), float(np.mean(chance @ n**2 - mean**2))


@pytest.mark.parametrize("s", [0.01, 0.1, 0.2, 0.3])
def test_the_scatter_of_rows_tells_what_noise_leaves_of_rounding(s: float) -> None:
    error, scatter = rounded(s)
    assert undithered(scatter) == pytest.approx(np.sqrt(error), rel=0.02)


def test_noise_of_half_a_step_blurs_rounding() -> None:
    x = np.random.default_rng(1).normal(0.0, 0.6, 5000)
    assert coarse(np.round(x)) is None


def test_a_staircase_read_in_steps_has_an_error_of_a_third_of_a_step() -> None:
    """Uniform in a step: 1 / sqrt(12) of it."""
    level = np.repeat(np.random.default_rng(2).uniform(-9, 9, 40), 200)
    found = coarse(np.round(level / 0.5) * 0.5, level)
    assert found is not None
    assert found.step == pytest.approx(0.5)
    assert found.rms == pytest.approx(0.5 / np.sqrt(12), rel=0.05)
