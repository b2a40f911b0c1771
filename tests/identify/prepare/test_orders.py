"""Waves of the table's angle in white noise: found at any order, and nothing where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.identify.prepare.orders import orders_p

N = 1500
ANGLE = 0.3 * np.arange(float(N))
CHANGE = np.full(N, 0.3)


def test_false_alarms_are_as_rare_as_they_are_said_to_be() -> None:
    """At 1 % in 150 runs of noise: more than 5 has a probability of 0.4 %; the bound of Bonferroni leaves room."""
    rng = np.random.default_rng(4)
    p = [orders_p([(rng.standard_normal(N), ANGLE, CHANGE)]) for _ in range(150)]
    assert np.sum(np.array(p) < 0.01) <= 5


@pytest.mark.parametrize("order", [0.5, 1.0, 2.44, 5.0])
def test_a_wave_that_no_effect_foresees_is_seen(order: float) -> None:
    """Strength 12, growing with time and changing its sign, as with temperature."""
    wave = np.linspace(-1, 1, N) * np.cos(order * ANGLE + 1.0)
    wave *= 12 / np.linalg.norm(wave)
    assert orders_p([(np.random.default_rng(5).standard_normal(N) + wave, ANGLE, CHANGE)]) < 1e-4


def test_a_wave_that_a_bin_averages_away_is_not_looked_for() -> None:
    noise = np.random.default_rng(6).standard_normal(N)
    assert orders_p([(noise + 10 * np.cos(ANGLE), ANGLE, np.full(N, 20.0))]) == 1.0
    assert orders_p([(noise, np.zeros(N), np.zeros(N))]) == 1.0


def test_blocks_are_judged_together() -> None:
    """A wave of strength 4 in each of four runs, its phase another in each: seen in all of them and in none alone."""
    rng = np.random.default_rng(7)
    waves = [4 * np.sqrt(2 / N) * np.cos(2.5 * ANGLE + phase) for phase in rng.uniform(0, 6, 4)]
    blocks = [(rng.standard_normal(N) + wave, ANGLE, CHANGE) for wave in waves]
    assert orders_p(blocks) < 1e-4 < 1e-3 < min(orders_p([one]) for one in blocks)
