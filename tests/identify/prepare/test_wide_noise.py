"""Noise that wanders further than an instrument's own bias does is not taken for its bias.

Seeds are fixed. A flicker of three times the bound is told to some per cent, one of a tenth is far below it.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest, simulated_noise

from insenv.core.recording import Channel, Recording
from insenv.identify.findings import TargetFindings

DT, N = 0.1, 6000


def at_rest(flicker: float, seed: int, unit: str) -> TargetFindings:
    """Ten minutes at rest with white noise and flicker (SI)."""
    rng = np.random.default_rng(seed)
    noise = {"angle_random_walk": 0.02 * flicker, "bias_instability": flicker}
    channel = "gyro" if unit == "rad/s" else "accel_z"
    y = simulated_noise(noise, N, DT, rng) + (0.0 if channel == "gyro" else 9.81)
    recording = Recording(DT * np.arange(1.0, N + 1), {channel: Channel(y, unit, "interval")})
    return closed(recording, manifest((channel,), ("bias",))).targets[0]


@pytest.mark.parametrize(("unit", "bound"), [("rad/s", np.deg2rad(0.1)), ("m/s^2", 0.02)])
@pytest.mark.parametrize("seed", [1, 2])
def test_only_what_wanders_too_far_is_a_doubt(unit: str, bound: float, seed: int) -> None:
    far, near = at_rest(3 * bound, seed, unit), at_rest(0.1 * bound, seed, unit)
    assert any("wanders by" in reason for reason in far.reasons)
    assert far.verdict != "nothing-significant"
    assert not any("wanders by" in reason for reason in near.reasons)
