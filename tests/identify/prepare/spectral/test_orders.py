"""Waves of the table's angle in white noise: found at any order, and nothing where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.identify.prepare.spectral.orders import order_of, strongest

N = 1500
ANGLE = 0.3 * np.arange(float(N))
CHANGE = np.full(N, 0.3)


def p_value(blocks: list[tuple[Floats, Floats, Floats]]) -> float:
    """Of the strongest wave."""
    return strongest(blocks).p_value


def test_false_alarms_are_as_rare_as_they_are_said_to_be() -> None:
    """At 1 % in 150 runs of noise: more than 5 has a probability of 0.4 %; the bound of Bonferroni leaves room."""
    rng = np.random.default_rng(4)
    p = [p_value([(rng.standard_normal(N), ANGLE, CHANGE)]) for _ in range(150)]
    assert np.sum(np.array(p) < 0.01) <= 5


@pytest.mark.parametrize("order", [0.5, 1.0, 2.44, 5.0])
def test_a_wave_that_no_effect_foresees_is_seen(order: float) -> None:
    """Strength 12, growing with time and changing its sign, as with temperature."""
    wave = np.linspace(-1, 1, N) * np.cos(order * ANGLE + 1.0)
    wave *= 12 / np.linalg.norm(wave)
    found = strongest([(np.random.default_rng(5).standard_normal(N) + wave, ANGLE, CHANGE)])
    assert found.p_value < 1e-4
    assert found.order == pytest.approx(order, abs=0.13)


def test_a_wave_that_a_bin_averages_away_is_not_looked_for() -> None:
    noise = np.random.default_rng(6).standard_normal(N)
    assert p_value([(noise + 10 * np.cos(ANGLE), ANGLE, np.full(N, 20.0))]) == 1.0
    assert p_value([(noise, np.zeros(N), np.zeros(N))]) == 1.0


def test_blocks_are_judged_together() -> None:
    """A wave of strength 4 in each of four runs, its phase another in each: seen in all of them and in none alone."""
    rng = np.random.default_rng(7)
    waves = [4 * np.sqrt(2 / N) * np.cos(2.5 * ANGLE + phase) for phase in rng.uniform(0, 6, 4)]
    blocks = [(rng.standard_normal(N) + wave, ANGLE, CHANGE) for wave in waves]
    assert p_value(blocks) < 1e-4 < 1e-3 < min(p_value([one]) for one in blocks)


@pytest.mark.parametrize("of_rate", [False, True])
def test_a_line_that_reverses_with_the_table_goes_with_its_angle(of_rate: bool) -> None:
    """Six times a turn, 16 deviations, in the rate or in the angle: a wave of time takes half of it."""
    angle = np.concatenate([ANGLE[: N // 2], ANGLE[N // 2 : 0 : -1]])[:N] / 8
    change, t = np.gradient(angle), 0.1 * np.arange(float(N))
    wave = 0.55 * np.cos(6 * angle + 0.4) * (np.sign(change) if of_rate else 1.0)
    left = np.random.default_rng(8).standard_normal(N) + wave
    frequency = 6 * 0.3 / 8 / 0.1 / (2 * np.pi)
    assert order_of([(left, angle, change)], [t], frequency) == 6
    of_time = np.random.default_rng(9).standard_normal(N) + 0.55 * np.cos(2 * np.pi * frequency * t + 0.4)
    assert order_of([(of_time, angle, change)], [t], frequency) == 0


def test_a_line_beside_a_table_of_one_speed_is_its_own_unless_it_comes_a_whole_number_of_times_a_turn() -> None:
    rng, angle, t = np.random.default_rng(10), ANGLE / 8, 0.1 * np.arange(float(N))
    block = (rng.standard_normal(N) + 0.5 * np.cos(5 * angle), angle, CHANGE / 8)
    between = (rng.standard_normal(N) + 0.5 * np.cos(5.3 * angle), angle, CHANGE / 8)
    per_turn = 0.3 / 8 / 0.1 / (2 * np.pi)
    assert order_of([block], [t], 5 * per_turn) == 5
    assert order_of([between], [t], 5.3 * per_turn) == 0
