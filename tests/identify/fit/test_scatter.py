"""Whether estimates scatter beyond chance, where their errors are independent and where they have something in common.

1000 draws with fixed seeds: a share of 0.05 that is right is within 0.03 and 0.07 in 99.6 %.
"""

from __future__ import annotations

import numpy as np

from insenv.identify.fit.scatter import scatter, scatter_of_correlated

SD = np.array([1.0, 2.0, 0.5, 1.5])


def test_independent_errors_are_a_diagonal_covariance() -> None:
    values = np.array([0.3, -4.0, 1.1, 2.0])
    assert scatter(values, SD) == scatter_of_correlated(values, np.diag(SD**2))


def test_what_estimates_have_in_common_is_no_scatter() -> None:
    """Of gains beside one that goes with the temperature the errors do too; taken for independent they scatter."""
    rng = np.random.default_rng(1)
    heat = np.array([-1.5, -0.5, 0.5, 1.5])
    covariance = np.diag(SD**2) + 20.0 * np.outer(heat, heat)
    draws = rng.multivariate_normal(np.zeros(4), covariance, 1000)
    chances = np.array([scatter_of_correlated(g, covariance).chance for g in draws])
    assert 0.03 < np.mean(chances < 0.05) < 0.07
    assert np.mean([scatter(g, SD).chance < 0.05 for g in draws]) > 0.5


def test_the_variance_between_is_what_was_drawn() -> None:
    """Its mean over 1000 draws, each of four, is within 4 of its own deviations of what was drawn."""
    rng = np.random.default_rng(2)
    covariance = np.diag(SD**2) + 0.3 * np.outer(SD, SD)
    draws = rng.multivariate_normal(np.zeros(4), covariance + 25.0 * np.eye(4), 1000)
    between = np.array([scatter_of_correlated(g, covariance).between for g in draws])
    assert abs(between.mean() - 25.0) < 4 * between.std() / np.sqrt(len(between)) + 0.5
