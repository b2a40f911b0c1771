"""Lines that move in white noise: found at any speed, and nothing where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.identify.prepare.spectral.sweeps import sweeps_p

N = 900


def chirp(n: int, first: float, last: float, strength: float) -> Floats:
    """A line that goes from one frequency to another, in cycles per bin."""
    t = np.arange(float(n))
    wave = np.sin(2 * np.pi * (first * t + (last - first) * t**2 / (2 * n)) + 1.0)
    return np.asarray(strength * wave / np.linalg.norm(wave))


def test_false_alarms_are_rarer_than_they_are_said_to_be() -> None:
    """At 5 % in 120 runs of noise: more than 12 has a probability of 1 %; a bound, so fewer."""
    rng = np.random.default_rng(1)
    p = [sweeps_p((rng.standard_normal(300), rng.standard_normal(140))) for _ in range(120)]
    assert np.sum(np.array(p) < 0.05) <= 12


@pytest.mark.parametrize(("first", "last"), [(0.02, 0.04), (0.3, 0.1), (0.2, 0.44)])
def test_a_line_that_moves_is_seen(first: float, last: float) -> None:
    """Strength 9; a line that stands is another test's, and is seen too."""
    noise = np.random.default_rng(2).standard_normal(N)
    assert sweeps_p((noise + chirp(N, first, last, 9.0),)) < 1e-4
    assert sweeps_p((noise,)) > 0.01


def test_runs_that_do_the_same_are_judged_together() -> None:
    rng = np.random.default_rng(3)
    runs = tuple(rng.standard_normal(N) + chirp(N, 0.1, 0.2, 6.0) for _ in range(4))
    assert sweeps_p(runs) < 1e-6
    assert sweeps_p(runs[:1]) > 1e-3


def test_what_is_louder_at_all_frequencies_is_no_line() -> None:
    """Noise of twice the power that it is said to have: its largest wave would be one in millions."""
    rng = np.random.default_rng(4)
    assert min(sweeps_p((np.sqrt(2) * rng.standard_normal(N),)) for _ in range(5)) > 0.01


def test_gaps_and_short_runs_do_no_harm() -> None:
    series = np.random.default_rng(5).standard_normal(N)
    series[200:400] = 0.0
    assert sweeps_p((series + 3.0 * (series != 0),)) > 0.01
    assert sweeps_p((series[:20],)) == 1.0
    assert sweeps_p(()) == 1.0
