"""Curves that are right only nearly: the other parameters are told to be less certain, and where right they are not."""

from __future__ import annotations

import numpy as np
import pytest
from fit_cases import problem_of, terms
from motions import edges

from insenv.core.recording import Channel, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.fit.discrepancy import added_variance
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term


def grown(bend: float, seed: int) -> float:
    """Share by which the scale factor's standard deviation grows, the warm-up's decay bent by a second exponential."""
    t, rng = edges(12000, 0.1)[1:], np.random.default_rng(seed)
    rate = 0.3 * np.sign(np.sin(0.02 * t))
    share = (1 - bend) * np.exp(-t / 300) + bend * np.exp(-t / 60)
    y = rate * (1 + 1e-3 * share) + 1e-5 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(y, "rad/s", "interval"), "table_rate": Channel(rate, "rad/s", "interval")}
    problem, _ = problem_of(Recording(t, channels))
    term = Term(by_key("scale_factor_warm_up"), (300.0,))
    fit = solve(problem, (*terms("bias", "scale_factor"), term))
    place = [label[0] for label in fit.design.labels].index("scale_factor")
    return float(np.sqrt(1 + added_variance(problem, fit, (term,))[place] / fit.cov[place, place]))


def test_a_right_curve_costs_little() -> None:
    assert np.median([grown(0.0, seed) for seed in range(8)]) < 1.3


def test_a_bent_curve_is_felt() -> None:
    assert grown(0.3, 1) > 3


@pytest.mark.parametrize("key", ["tone", "timing_skew", "encoder_harmonic:1", "bias_temperature:1"])
def test_a_line_has_no_curve_to_be_bent(key: str) -> None:
    t = edges(2000, 0.1)[1:]
    channels = {"gyro": Channel(np.random.default_rng(0).standard_normal(len(t)), "rad/s", "interval")}
    problem, _ = problem_of(Recording(t, channels))
    fit = solve(problem, terms("bias"))
    shape = (0.1,) if key == "tone" else ()
    assert not added_variance(problem, fit, (Term(by_key(key), shape),)).any()
