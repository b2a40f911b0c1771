"""Runs of one instrument wander alike: one that does not is said, and a walk of all of them is none."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import TargetFindings
from insenv.identify.fit.bins import Block
from insenv.identify.prepare.alike import most_unlike


def blocks(runs: int, length: int) -> list[Block]:
    return [Block(run, True, run * length, (run + 1) * length, length) for run in range(runs)]


@pytest.mark.parametrize("runs", [3, 6, 17])
def test_noise_that_is_alike_is_hardly_ever_said_to_be_unlike(runs: int) -> None:
    """Below 1e-3 none of 500 by the tolerance (each 1e-3 without one: none in 500 then in 60 % of seeds)."""
    rng = np.random.default_rng(runs)
    found = [most_unlike(blocks(runs, 60), rng.standard_normal(60 * runs)) for _ in range(500)]
    assert all(one is not None and one.p_value > 1e-3 for one in found)


def test_two_runs_tell_nothing_and_short_ones_little() -> None:
    assert most_unlike(blocks(2, 60), np.ones(120)) is None
    assert most_unlike(blocks(4, 4), np.ones(16)) is None


def days(seed: int, bump: float) -> TargetFindings:
    """The loop on an hour of a gyro on each of five days; on the third the sun is on it for a while."""
    rng, runs = np.random.default_rng(seed), []
    t = np.arange(1.0, 3601.0)
    for day in range(5):
        walk: Floats = np.cumsum(2e-9 * rng.standard_normal(len(t)))
        values = 3e-6 * rng.standard_normal() + walk + 1e-6 * rng.standard_normal(len(t))
        values += (day == 2) * bump * np.exp(-(((t - 1900) / 400) ** 2))
        runs.append(Recording(t, {"gyro": Channel(values, "rad/s")}, label=f"day {day}"))
    (target,) = closed(tuple(runs), manifest(("gyro",), ("bias",))).targets
    return target


@pytest.mark.parametrize("seed", range(2))
def test_a_day_that_wanders_more_than_the_others_is_said(seed: int) -> None:
    """The walk of all of them had taken up a hump of forty deviations: nothing significant was missing."""
    said = " ".join(days(seed, 1.5e-6).reasons)
    assert "wanders more than the others" in said and "run 3" in said
    assert not days(seed, 0.0).reasons
