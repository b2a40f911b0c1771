"""A unit beside what it was told: what it did not do of that is no error of its gyro.

Generated with NumPy; seeds are fixed.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Recording


def flown(seed: int, own: float) -> Recording:
    """A craft on a course of three laps, late by 0.2 s, that leaves it by ``own`` [rad/s], alike in every lap."""
    rng, t = np.random.default_rng(seed), 0.01 * np.arange(6000, dtype=np.float64)
    lap = 2 * np.pi * t / 20

    def course(at: Floats) -> Floats:
        return 1.5 * np.sin(at) + 1.2 * np.sin(3 * at + 1) + 0.6 * np.sin(5 * at + 2)

    strayed = own * (np.sin(4 * lap) + 0.7 * np.sin(7 * lap + 1))
    y = 1.1 * course(lap - 2 * np.pi * 0.2 / 20) + strayed + 0.05 + 0.01 * rng.standard_normal(len(t))
    told = Channel(course(lap), "rad/s", source="command")
    return Recording(t, {"gyro": Channel(y, "rad/s"), "table_rate": told})


@pytest.mark.parametrize("seed", [1, 2])
def test_what_a_craft_did_not_do_that_it_was_told_to_is_no_law_of_its_gyro(seed: int) -> None:
    """Harmonics of an encoder that there is none of were named, and a gain of 0.13 +- 0.15 that is 1.1."""
    (found,) = closed(flown(seed, 0.5), manifest()).targets
    assert {one.effect for one in found.added} <= {"timing_skew"}
    assert any("did not do what it was told" in reason for reason in found.reasons)
    (scale,) = [e for e in found.estimates_after if e.effect == "scale_factor"]
    assert abs(scale.value - 0.1) < 3 * scale.sd
    assert "scale_factor_cubic" in {one.effect for one in found.not_testable}


def test_one_that_does_it_may_have_laws() -> None:
    (found,) = closed(flown(3, 0.0), manifest()).targets
    assert not any("did not do what it was told" in reason for reason in found.reasons)
    assert "scale_factor_cubic" not in {one.effect for one in found.not_testable}
    (scale,) = [e for e in found.estimates_after if e.effect == "scale_factor"]
    assert abs(scale.value - 0.1) < 4 * scale.sd < 0.01


def test_a_wave_of_a_table_that_keeps_its_one_rate_is_no_disobedience() -> None:
    """Gain and lag foretell none of the noise about one rate; the wave was a tone at the frequency of the turns."""
    rng, t = np.random.default_rng(4), 0.02 * np.arange(6001, dtype=np.float64)
    angle = 0.5 * t
    wave = 2e-4 * np.cos(0.5 * (angle[1:] + angle[:-1]))
    y = np.diff(angle) / 0.02 + wave + 1e-3 * rng.standard_normal(6000)
    channels = {"gyro": Channel(y, "rad/s", "interval"), "table_angle": Channel(angle[1:], "rad", source="command")}
    (found,) = closed(Recording(t[1:], channels), manifest()).targets
    assert not any("did not do what it was told" in reason for reason in found.reasons)
    assert "angle_locked_rate" in {one.effect for one in found.added}
