"""A line at a few times the frequency at which the motion repeats goes with the motion."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.prepare.problems import prepare
from insenv.identify.prepare.spectral.cycles import each_cycle, period
from insenv.identify.prepare.spectral.wandering import heated_there

DT, N = 0.1, 6000
T: Floats = DT * np.arange(N, dtype=np.float64)


def moves() -> Floats:
    """Moves of 8 s and rests of 10 s, of other angles and either way."""
    angles = np.array([1.0, -0.4, 0.7, -1.2, 0.9, -0.5, 1.3])
    k = (T / 18.0).astype(int)
    phase = np.minimum(np.mod(T, 18.0) / 8.0, 1.0)
    return angles[k % len(angles)] * np.sin(np.pi * phase) ** 2


@pytest.mark.parametrize("seconds", [7.3, 20.0, 49.0])
def test_the_period_of_a_swing_is_known_to_a_part_of_a_bin(seconds: float) -> None:
    swing = np.sin(2 * np.pi * T / seconds)
    assert period(swing) * DT == pytest.approx(seconds, abs=DT / 4)
    assert period(np.abs(swing)) * DT == pytest.approx(seconds / 2, abs=DT / 4)


def test_what_does_not_repeat_has_no_period() -> None:
    """Noise, a walk, a sweep and a staircase up and down."""
    rng = np.random.default_rng(5)
    stairs = np.repeat([0.0, 1, 2, 3, 4, 5, 4, 3, 2, 1], N // 10)
    sweep = np.sin(2 * np.pi * T * (0.01 + T / 6000))
    for motion in (rng.standard_normal(N), np.cumsum(rng.standard_normal(N)), stairs, sweep, np.zeros(N)):
        assert period(motion) == 0.0


@pytest.mark.parametrize(("hertz", "order"), [(1 / 18, 1), (2 / 18, 2), (0.13, 0), (2.0, 0)])
def test_moves_of_other_angles_on_one_beat_repeat(hertz: float, order: int) -> None:
    rate = moves()
    channels = {"gyro": Channel(rate, "rad/s"), "table_rate": Channel(rate, "rad/s", source="encoder")}
    problem = prepare(manifest(), (Recording(T, channels),), (use(N),), "gyro", tones=False, holds=False).problem
    assert each_cycle(problem, hertz) == order


@pytest.mark.parametrize(("hertz", "found"), [(0.02, True), (0.05, False)])
def test_a_line_that_the_temperature_has_is_told(hertz: float, found: bool) -> None:
    """A chamber's controller goes to and fro 20 mHz beside a slow rise; five tones were named of one bias."""
    rng = np.random.default_rng(6)
    warm = 300.0 + 10.0 * T / T[-1] + 0.3 * np.sin(2 * np.pi * 0.02 * T) + 0.02 * rng.standard_normal(N)
    channels = {"gyro": Channel(rng.standard_normal(N), "rad/s"), "temperature": Channel(warm, "K")}
    problem = prepare(manifest(), (Recording(T, channels),), (use(N),), "gyro", tones=False, holds=False).problem
    assert heated_there(problem, hertz) is found
