"""A bias that goes to and fro between two levels, or bends, beside a table that turns: said, with its size.

Flicker and a walk of the noise stand for both, and nothing was said of either.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from strangers import closed_at_rest, closed_rate_file

from insenv.identify.findings import TargetFindings
from insenv.identify.prepare.two_levels import two_levels

Floats = NDArray[np.float64]
N, DT = 2400, 0.1


def flips(rng: np.random.Generator, mean: float, n: int = N) -> Floats:
    """0 or 1, which changes after times that are exponential, of so many rows in the mean."""
    edges = np.cumsum(rng.exponential(mean, n))
    return np.asarray(np.searchsorted(edges, np.arange(n)) % 2, np.float64)


def judged(folder: Path, bias: Floats, rng: np.random.Generator) -> TargetFindings:
    t = DT * np.arange(1.0, N + 1)
    rate = 0.5 * np.sin(2 * np.pi * t / 7.3)
    gyro = rate + bias + 2e-4 * rng.standard_normal(N)
    return closed_rate_file(folder, t, gyro, rate)


@pytest.mark.parametrize(
    ("kind", "word"),
    [("flips", "to and fro between"), ("shifts", "to and fro between"), ("bends", "bends in time"), ("none", "")],
)
def test_a_bias_that_no_effect_is_is_said_with_its_size(tmp_path: Path, kind: str, word: str) -> None:
    rng = np.random.default_rng(4)
    bend = (np.arange(N) / N - 0.45) ** 2
    shifts: Floats = np.searchsorted([0.21, 0.33, 0.52], np.arange(N) / N) % np.float64(2)
    bias = {
        "flips": 3e-4 * flips(rng, 100.0),
        "shifts": 2e-4 * shifts,
        "bends": 1.2e-3 * bend,
        "none": np.zeros(N),
    }[kind]
    found = judged(tmp_path, bias, rng)
    said = [reason for reason in found.reasons if "to and fro" in reason or "bends in time" in reason]
    assert [word in reason for reason in said] == ([True] if word else [])
    assert not {a.effect for a in found.added} - {"spline_time"}
    if word.startswith("to"):
        apart, unit = said[0].split("two levels ")[1].split(" ")[:2]
        assert unit == "deg/h"
        assert np.radians(float(apart)) / 3600 == pytest.approx(3e-4 if kind == "flips" else 2e-4, rel=0.2)


def test_a_chain_of_two_levels_is_told_from_white_noise() -> None:
    rng = np.random.default_rng(0)
    for _ in range(6):
        white = rng.standard_normal(150)
        plain = -0.5 * 150 * (np.log(2 * np.pi * white.var()) + 1)
        assert two_levels(white).loglik - plain < np.log(3000)  # four parameters more: chance 2e-3 at most each
    state = flips(rng, 15.0, 150)
    found = two_levels(2.5 * state + rng.standard_normal(150))
    assert found.apart == pytest.approx(2.5, abs=0.6)
    assert np.mean(found.upper != (state > 0.5)) < 0.15


@pytest.mark.parametrize(("kind", "said"), [("flips", True), ("pulses", True), ("walk", False)])
def test_a_bias_that_goes_to_and_fro_at_rest_is_no_noise(tmp_path: Path, kind: str, said: bool) -> None:
    """Free noise took 24 jumps of four hours, and pulses as of a crane that passes, for flicker and a walk.

    Of 107 channels of recordings at rest none was as likely two levels.
    """
    rng, n = np.random.default_rng(7), 8000
    t = 0.5 * np.arange(n)
    starts = rng.uniform(0.05, 0.95, 9) * n
    pulses: Floats = np.sum([(starts < k) & (k < starts + 80) for k in np.arange(n)[:, None]], axis=1) * 1.0
    bias = {
        "flips": 2.4e-4 * flips(rng, 400.0, n),
        "pulses": 6e-4 * pulses,
        "walk": 1e-5 * np.cumsum(rng.standard_normal(n)),
    }[kind]
    found = closed_at_rest(tmp_path, t, 1e-3 + bias + 6e-4 * rng.standard_normal(n), "1 s")
    assert any("to and fro between" in reason for reason in found.reasons) is said
    assert (found.verdict == "unexplained-structure") is said
