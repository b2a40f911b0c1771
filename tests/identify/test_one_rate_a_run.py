"""Rate tables of which each file holds one rate: the gain stands between the runs, and in none of them.

Generated with NumPy; the seed is fixed. The scale factor has 11 standard deviations and more.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Mounting, Recording, Site
from insenv.data.exposure import expose, turns

SCALE, BIAS, WHITE = 2e-3, 5e-3, 1e-3


def run(rate: float, seed: int) -> Recording:
    """A gyro on a table that turns at one commanded rate [rad/s], a minute at 10 Hz."""
    rng, t = np.random.default_rng(seed), 0.1 * np.arange(1.0, 601.0)
    y = (1 + SCALE) * rate + BIAS + WHITE * rng.standard_normal(len(t)) / np.sqrt(0.1)
    command = Channel(np.full(len(t), rate), "rad/s", "interval", source="command")
    return Recording(t, {"gyro": Channel(y, "rad/s", "interval"), "table_rate": command}, label=f"{rate:g}")


def test_a_gain_between_runs_of_one_rate_each_is_named() -> None:
    runs = tuple(run(rate, seed) for seed, rate in enumerate((0.5, -0.5, 1.0, -1.0)))
    found = closed(runs, manifest(declared=("bias",), averaging=1.0)).targets[0]
    (added,) = found.added
    assert (added.effect, found.verdict) == ("scale_factor", "effects-found")
    (size,) = added.parameters
    assert abs(size.value - SCALE) < 4 * size.sd < 0.5 * SCALE
    assert found.held_out.after < 0.7 * found.held_out.before


def test_runs_of_one_and_the_same_rate_tell_no_gain() -> None:
    runs = tuple(run(0.5, seed) for seed in range(3))
    found = closed(runs, manifest(declared=("bias",), averaging=1.0)).targets[0]
    assert not found.added
    assert "scale_factor" in {one.effect for one in found.not_testable}


def test_the_earths_rate_in_two_positions_is_no_turn() -> None:
    still = {"gyro": Channel(np.zeros(100), "rad/s", "interval")}
    up, down = (
        Recording(0.1 * np.arange(1.0, 101.0), still, mounting=Mounting(tilt), site=Site(latitude=0.9), label="a")
        for tilt in (np.pi / 2, -np.pi / 2)
    )
    seen = [expose(run, "gyro", with_earth=True) for run in (up, down)]
    assert seen[0].u[0] == -seen[1].u[0] != 0
    assert not turns(seen)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_of_an_encoder_at_one_rate_tells_no_gain(seed: int) -> None:
    """Steps of the angle are all that changes in the reference, and the reading knows nothing of them."""
    rng, t = np.random.default_rng(seed), 0.1 * np.arange(1.0, 1301.0)
    step = 2 * np.pi / 2**12
    angle = np.floor(0.087 * t / step) * step + 0.4 * step * rng.standard_normal(len(t))
    y = (1 + SCALE) * 0.087 + BIAS + 1e-4 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(y, "rad/s"), "table_angle": Channel(angle, "rad", source="encoder")}
    (found,) = closed(Recording(t, channels), manifest()).targets
    told = [one for one in found.estimates_after if one.effect == "scale_factor"]  # of some no gain is stated at all
    assert all(abs(one.value - SCALE) < 3 * one.sd for one in told)
    assert not any("does not follow" in text for text in found.reasons)
