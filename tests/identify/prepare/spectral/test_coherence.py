"""What is left at a frequency goes with a measured reference, or does not.

Seeds are fixed. Of series that know nothing of each other 1 in 1000 may be said to; of 600 more than 4 are with the
probability 4e-4.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.prepare.spectral.coherence import follows

DT = 0.005


def test_series_that_know_nothing_of_each_other_do_not_follow() -> None:
    rng = np.random.default_rng(1)
    said = 0
    for k in range(600):
        n, cycles = int(rng.choice([400, 2000, 6000])), float(rng.uniform(0.02, 0.48))
        line = 2 * np.cos(2 * np.pi * cycles * np.arange(n) + 0.3 * np.cumsum(rng.standard_normal(n)) / 10)
        other = rng.standard_normal(n)
        said += follows([(line + rng.standard_normal(n), np.cumsum(other) if k % 2 else other)], cycles)
    assert said <= 4


@pytest.mark.parametrize("gain", [0.1, -0.3])
def test_what_a_filter_leaves_of_a_ripple_follows_it(gain: float) -> None:
    rng = np.random.default_rng(2)
    n = 4000
    phase = 2 * np.pi * 0.1 * np.arange(n) + 0.5 * np.cumsum(rng.standard_normal(n)) / 5
    ripple = np.cos(phase) * (1 + np.sin(np.arange(n) / 300))
    left = gain * np.roll(ripple, 2) + 0.05 * rng.standard_normal(n)
    assert follows([(left, 30 * np.sin(np.arange(n) / 700) + ripple)], 0.1)


def rippled(seed: int, own: float) -> Recording:
    """A table that swings once in 40 s, 48 ripples a turn, beside the mean of an encoder's rate over 10 rows.

    ``own`` is a line of the gyro by itself, at 31 Hz.
    """
    rng = np.random.default_rng(seed)
    t: Floats = DT * np.arange(24000, dtype=np.float64)
    angle = 16.0 * np.sin(2 * np.pi * t / 40)
    rate = np.gradient(angle, DT) * (1 + 0.004 * np.cos(48 * angle))
    read = np.convolve(rate, np.ones(10) / 10, "full")[: len(t)] + 2e-4 * rng.standard_normal(len(t))
    gyro = rate + own * np.cos(2 * np.pi * 31.0 * t) + 2e-3 * rng.standard_normal(len(t))
    channels = {
        "gyro": Channel(gyro, "rad/s", "instant"),
        "table_rate": Channel(read, "rad/s", "instant", source="encoder"),
    }
    return Recording(
        t[12:], {name: Channel(c.values[12:], c.unit, c.covers, source=c.source) for name, c in channels.items()}
    )


@pytest.mark.parametrize("own", [0.0, 2e-3])
def test_a_ripple_of_the_motor_is_no_tone_beside_a_filtered_rate(own: float) -> None:
    (target,) = closed(rippled(3, own), manifest()).targets
    tones = [e.value for one in target.added if one.effect == "tone" for e in one.parameters if e.parameter == "f"]
    assert [round(f) for f in tones] == ([31] if own else [])


def test_one_reversal_does_not_hide_that_a_ripple_is_followed() -> None:
    rng = np.random.default_rng(4)
    n = 12_000
    ripple = np.cos(2 * np.pi * 0.01 * np.arange(n))
    turned = np.where(np.arange(n) < 6000, 200.0, -200.0)
    assert follows([(0.1 * ripple + 0.02 * rng.standard_normal(n), turned + ripple)], 0.01)
