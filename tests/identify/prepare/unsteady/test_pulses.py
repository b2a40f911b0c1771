"""Pulses that come again and again: their interval, length and height, however weak one of them is.

Generated with NumPy alone; strengths are in deviations of a row.
"""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.identify.prepare.unsteady.pulses import Pulses, pulses
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft, white

N, DT = 20000, 0.01


def found(more: Floats, seed: int = 1, lines: tuple[tuple[float, float], ...] = ()) -> Pulses | None:
    rows = np.random.default_rng(seed).standard_normal(len(more)) + more
    made = white(RowsLeft(0, 0.0, DT, rows, lines=lines))
    assert made is not None
    return pulses(made)


def sure(one: Pulses | None) -> bool:
    return one is not None and one.log_p < np.log(1e-5)


@pytest.mark.parametrize(
    ("interval", "rows", "height"),
    [(1000.0, 6, 2.0), (50.0, 1, 1.0), (333.3, 8, 1.0), (12.5, 1, 0.6), (811.5, 30, 1.0)],
)
def test_pulses_have_their_interval(interval: float, rows: int, height: float) -> None:
    at = np.arange(N) % interval < rows
    one = found(np.asarray(height * at, float))
    assert one is not None and sure(one)
    assert one.interval == pytest.approx(DT * interval, rel=2e-3)
    assert DT * rows / 3 <= one.length <= 3 * DT * rows
    assert 0.25 * height < one.times < 1.2 * height


def test_pulses_may_go_down() -> None:
    one = found(np.asarray(-2.0 * (np.arange(N) % 700 < 4), float))
    assert sure(one)


@pytest.mark.parametrize("kind", ["noise", "a line", "knocks", "a step"])
def test_what_comes_once_and_what_swings_is_none(kind: str) -> None:
    """At 1e-5 each: 10 draws of each have one with a probability of 0.01 %."""
    n = 8000
    t = np.arange(n) * DT
    rng = np.random.default_rng(2)
    for seed in range(10):
        knocks = np.zeros(n)
        knocks[rng.integers(0, n, 9)] = 30.0
        more = {
            "noise": np.zeros(n),
            "a line": 0.3 * np.cos(2 * np.pi * 0.83 * t + seed),
            "knocks": knocks,
            "a step": 0.5 * (t > 40.0),
        }[kind]
        assert not sure(found(more, seed))


def test_lines_that_are_told_elsewhere_are_no_pulses() -> None:
    """Harmonics of 2 Hz, each of which is a line."""
    t = np.arange(N) * DT
    wave = np.asarray(sum(0.3 * np.cos(2 * np.pi * 2 * k * t) for k in range(1, 6)))
    assert sure(found(wave))
    assert not sure(found(wave, lines=tuple((2.0 * k, 0.0) for k in range(1, 6))))


def test_probabilities_are_bounds() -> None:
    """At 5 % in 40 records of noise: more than 7 has a probability of 0.1 %; a bound, so fewer."""
    seen = [found(np.zeros(2000), seed) for seed in range(40)]
    assert sum(one is not None and one.log_p < np.log(0.05) for one in seen) <= 7
