"""A scale factor beside a lag of unknown form: a table that swings at one frequency does not tell them apart.

Generated with NumPy; the seeds are fixed. Deviates beyond 4 have the probability 6e-5 a case.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import bilinear, lfilter
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import TargetFindings

DT, GAIN = 0.02, 1.004


def told(form: str, frequencies: tuple[float, ...], seed: int = 1) -> TargetFindings:
    """The loop beside a command that a table follows late by 80 ms."""
    rng = np.random.default_rng(seed)
    t: Floats = DT * np.arange(12000, dtype=np.float64)
    asked: Floats = np.mean([np.sin(2 * np.pi * f * t) for f in frequencies], axis=0)
    match form:
        case "first-order lag":
            b, a = bilinear([1.0], [0.08, 1.0], 1 / DT)
        case "servo":
            w = 2 * 0.6 / 0.08
            b, a = bilinear([w * w], [1.0, 1.2 * w, w * w], 1 / DT)
        case _:
            b, a = np.eye(5)[4], np.array([1.0])
    gyro = GAIN * lfilter(b, a, asked) + 2e-4 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro[50:], "rad/s"), "table_rate": Channel(asked[50:], "rad/s", source="command")}
    (target,) = closed(Recording(t[50:], channels), manifest(declared=("bias", "scale_factor"))).targets
    return target


def off(target: TargetFindings, effect: str, value: float) -> tuple[float, float]:
    """By how many of its deviations what is stated is off, and that deviation."""
    (found,) = [e for e in target.estimates_after if e.effect == effect]
    return abs(found.value - value) / found.sd, found.sd


@pytest.mark.parametrize("form", ["delay", "first-order lag", "servo"])
def test_the_scale_factor_at_one_frequency_is_as_uncertain_as_the_form_of_the_lag(form: str) -> None:
    """A first-order lag of 80 ms makes a swing of 0.11 Hz smaller by (2 pi 0.11 0.08)^2 / 2 = 1.5e-3."""
    away, sd = off(told(form, (0.11,)), "scale_factor", GAIN - 1)
    assert away < 4
    assert 3e-4 < sd < 2e-3


def test_a_delay_in_the_middle_of_a_swing_is_exact() -> None:
    """Of what the command was before the first row nothing is known; two frequencies tell a delay from a filter."""
    target = told("delay", (0.02, 0.35))
    assert [a.effect for a in target.added] == ["timing_skew"] and target.verdict == "effects-found"
    away, sd = off(target, "scale_factor", GAIN - 1)
    assert away < 4 and sd < 1e-4
    (lag,) = target.added[0].parameters
    assert lag.value == pytest.approx(0.08, abs=1e-4)


def test_a_filter_is_no_delay_of_a_certain_gain() -> None:
    """Its gain is that of slow motion: with a delay in its place it was 113 deviations off."""
    target = told("first-order lag", (0.02, 0.35))
    assert off(target, "scale_factor", GAIN - 1)[0] < 4 or target.verdict != "effects-found"
