"""Slow noise that is louder where a table turns faster is told from noise of every row that is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from insenv.effects.catalogue import by_key
from insenv.identify.prepare.excess import _fast_p
from insenv.identify.search.doubts.sizes import has_a_size

N, HOLD = 8000, 16


def asked(kind: str, seed: int) -> float:
    """P-value where the rate swings and so, with it, does slow noise, that of every row, or nothing."""
    rng = np.random.default_rng(seed)
    rate = np.sin(2 * np.pi * np.arange(N) / 333.0)
    slow = np.repeat(rng.standard_normal(N // HOLD), HOLD)
    white = rng.standard_normal(N)
    if kind == "slow":
        white = white + 0.5 * np.abs(rate) * slow
    elif kind == "rows":
        white = white * (0.5 + np.abs(rate))
    bins = SimpleNamespace(mean=lambda values: rate)
    problem = SimpleNamespace(turns=True, bins=bins, exposures=())
    return _fast_p(problem, ((SimpleNamespace(start=0, n=N), white / white.std()),))  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(4))
def test_slow_noise_that_goes_with_the_rate_is_seen(seed: int) -> None:
    assert asked("slow", seed) < 1e-3
    assert asked("rows", seed) > 1e-3  # late stamps do this: they are louder in single rows first of all
    assert asked("none", seed) > 1e-3  # false alarm 1e-3 each


def test_a_lag_and_a_line_have_a_name_without_a_size_and_a_law_of_the_bias_has_none() -> None:
    """A step of a third of its deviation was named beside a walk, and a drift of a fourteenth."""
    sized = {
        "bias_step": True,
        "bias_drift": True,
        "bias_temperature:1": True,
        "bias_temperature:2": False,  # its coefficients are told together alone
        "scale_factor": True,
        "scale_factor_cubic": True,
        "timing_skew": False,
        "tone": False,
    }
    assert {key: has_a_size(by_key(key)) for key in sized} == sized
