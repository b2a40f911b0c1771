"""A table read in coarse steps: no curve of the rate is named below half a step, and errors of parameters are honest.

Seeds are fixed; at `alpha` = 1 % one recording in a hundred has something named by chance.
"""

from __future__ import annotations

import numpy as np
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Recording
from insenv.identify.findings import Findings

STEP = np.deg2rad(1.0)


def staircase(step: float, cubic: float = 0.0, noise: float = 3e-4) -> Findings:
    """Sixteen rates of 15 s, twice, with ramps of 50 deg/s^2, read at 20 Hz in steps [rad/s]."""
    rng = np.random.default_rng(7)
    levels = np.deg2rad(np.repeat(np.tile(rng.permutation(np.linspace(-97.3, 94.1, 16)), 2), 300))
    rate = np.convolve(np.r_[np.zeros(40), levels], np.ones(40) / 40, "valid")[1:]
    read = 1.0005 * rate + 2e-3 + cubic * rate**3 + noise * rng.standard_normal(len(rate))
    channels = {"gyro": Channel(np.round(read / step) * step, "rad/s"), "table_rate": Channel(rate, "rad/s")}
    t = np.linspace(0.0, 0.05 * (len(rate) - 1), len(rate))
    return closed(Recording(t, channels), manifest())


def test_rounding_that_noise_does_not_blur_is_named_and_nothing_else_is() -> None:
    found = staircase(STEP).targets[0]
    assert {one.effect for one in found.added} == {"quantization"}
    assert abs(found.added[0].parameters[0].value / STEP - 1) < 1e-6
    scale = next(one for one in found.estimates_after if one.effect == "scale_factor")
    assert abs(scale.value - 5e-4) < 3 * scale.sd
    assert 3e-4 < scale.sd < 3e-3


def test_a_curve_larger_than_half_a_step_is_named() -> None:
    found = staircase(STEP, cubic=0.02).targets[0]
    assert "scale_factor_cubic" in {one.effect for one in found.added}


def test_rounding_below_the_noise_is_none() -> None:
    found = staircase(1e-4).targets[0]
    assert found.verdict == "nothing-significant"
