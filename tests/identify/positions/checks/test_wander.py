"""Biases that wander from rest to rest: a warm-up that a walk of them explains as well was not told at all.

Seeds are fixed. A walk is said by chance in less than 5e-3 of tests: in three of 40 with a probability of 2e-4.
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats
from insenv.core.units import STANDARD_GRAVITY
from insenv.effects.triad import AccelBias, AccelScaleFactor
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.checks.wander import wandering
from insenv.identify.positions.least_squares import solve
from insenv.identify.positions.model import Surroundings, triad_term

TIME, NOISE = 10.0 * np.arange(24.0), 1e-3


def said(bias: Floats, seed: int) -> tuple[str, ...]:
    """Of 24 rests in drawn attitudes, the biases of the axes larger by ``bias`` in each, shape (24,) [m/s^2]."""
    rng = np.random.default_rng(seed)
    unit = rng.standard_normal((24, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    every = np.ones(24, bool)
    measured = STANDARD_GRAVITY * unit + bias[:, None] * [1.0, -0.6, 0.4] + NOISE * rng.standard_normal((24, 3))
    problem = Magnitudes(measured, np.full(24, STANDARD_GRAVITY), Surroundings(TIME), every, every)
    terms = [triad_term(AccelBias()), triad_term(AccelScaleFactor())]
    return wandering(problem, solve(problem, terms), (), TIME, NOISE)


def test_a_warm_up_from_rest_to_rest_is_said() -> None:
    found = [said(0.05 * np.exp(-TIME / 60), seed) for seed in range(6)]
    assert all("wander from rest to rest" in one for (one,) in found)


def test_rests_that_repeat_say_nothing() -> None:
    assert sum(bool(said(np.zeros(24), seed)) for seed in range(40)) < 3


def test_what_is_less_than_an_accelerometer_repeats_is_nothing() -> None:
    assert not any(said(2e-3 * np.exp(-TIME / 60), seed) for seed in range(6))
